/* What a careful C programmer gets on one core: an INS/GNSS filter of 15 states, closed loop, dense
   covariance, plain form; one fix each ng samples, covariance every kp samples.
   gcc -O3 -march=native -fno-math-errno -mprefer-vector-width=128 -shared -fPIC */
#include <math.h>
#include <string.h>
// ---- (b) full NED mechanization, WGS84 ----
#define RATE 7.292115e-5
#define EA 6378137.0
#define E2 6.6943799901413e-3
#define GE 9.7803253359
#define GP 9.8321849378
static inline void rotmat(const double*r,double*m){
  double n2=r[0]*r[0]+r[1]*r[1]+r[2]*r[2],cs,k1,k2;
  if(n2>1e-6){double n=sqrt(n2);cs=cos(n);k1=sin(n)/n;k2=(1-cs)/n2;}
  else{double n4=n2*n2;cs=1-n2/2+n4/24;k1=1-n2/6+n4/120;k2=0.5-n2/24+n4/720;}
  double x=r[0],y=r[1],z=r[2];
  m[0]=k2*x*x+cs;m[1]=k2*x*y-k1*z;m[2]=k2*x*z+k1*y;
  m[3]=k2*y*x+k1*z;m[4]=k2*y*y+cs;m[5]=k2*y*z-k1*x;
  m[6]=k2*z*x-k1*y;m[7]=k2*z*y+k1*x;m[8]=k2*z*z+cs;
}
static inline void mm(const double*a,const double*b,double*c){
  for(int i=0;i<3;i++)for(int j=0;j<3;j++)c[3*i+j]=a[3*i]*b[j]+a[3*i+1]*b[3+j]+a[3*i+2]*b[6+j];
}
typedef struct{double lat,lon,alt,v[3],C[9];}nav_t; // lat lon rad
static inline void step(nav_t*s,const double*th,const double*dv,double dt){
  static double F=0; if(F==0)F=sqrt(1-E2)*GP/GE-1;
  double sl=sin(s->lat),cl=sqrt(1-sl*sl),tl=sl/cl;
  double x=1-E2*sl*sl,re=EA/sqrt(x),rn=re*(1-E2)/x+s->alt; double sx=sqrt(x); re+=s->alt;
  double O1=RATE*cl,O3=-RATE*sl,V1=s->v[0],V2=s->v[1],V3=s->v[2];
  double r1=V2/re,r2=-V1/rn,r3=-r1*tl,c1=O1+r1,c2=r2,c3=O3+r3;
  const double*C=s->C;
  double d1=C[0]*dv[0]+C[1]*dv[1]+C[2]*dv[2],d2=C[3]*dv[0]+C[4]*dv[1]+C[5]*dv[2],d3=C[6]*dv[0]+C[7]*dv[1]+C[8]*dv[2];
  double h=s->alt-0.5*V3*dt;
  double g=GE*(1+F*sl*sl)/sx*(1-2*h/EA);
  double n1=V1+d1+(-c2*V3+(c3+O3)*V2-0.5*(c2*d3-c3*d2))*dt;
  double n2=V2+d2+(-(c3+O3)*V1+(c1+O1)*V3-0.5*(c3*d1-c1*d3))*dt;
  double n3=V3+d3+(-(c1+O1)*V2+c2*V1-0.5*(c1*d2-c2*d1)+g)*dt;
  s->v[0]=n1;s->v[1]=n2;s->v[2]=n3;
  V1=0.5*(V1+n1);V2=0.5*(V2+n2);V3=0.5*(V3+n3);
  r1=V2/re;r2=-V1/rn;r3=-r1*tl;c1=O1+r1;c2=r2;c3=O3+r3;
  s->lat-=r2*dt;s->lon+=r1/cl*dt;s->alt-=V3*dt;
  double xi[3]={-c1*dt,-c2*dt,-c3*dt},A[9],B[9],T[9];
  rotmat(xi,A);rotmat(th,B);mm(s->C,B,T);mm(A,T,s->C);
}
static inline void incr(const double*g0,const double*g1,const double*f0,const double*f1,double dt,double*th,double*dv){
  double k=dt*dt/12, G[3],V[3],bg[3],bf[3];
  for(int i=0;i<3;i++){bg[i]=g1[i]-g0[i];bf[i]=f1[i]-f0[i];G[i]=(g0[i]+0.5*bg[i])*dt;V[i]=(f0[i]+0.5*bf[i])*dt;}
  for(int i=0;i<3;i++){int j=(i+1)%3,l=(i+2)%3;
    th[i]=G[i]+k*(g0[j]*bg[l]-g0[l]*bg[j]);
    dv[i]=V[i]+k*(g0[j]*bf[l]-g0[l]*bf[j]+f0[j]*bg[l]-f0[l]*bg[j])+0.5*(G[j]*V[l]-G[l]*V[j]);}
}
// ---- (c) 15-state dense closed-loop KF, phi-angle, pos 3-vector every ng samples ----
#define N 15
static inline void skew(const double*v,double*m){m[0]=0;m[1]=-v[2];m[2]=v[1];m[3]=v[2];m[4]=0;m[5]=-v[0];m[6]=-v[1];m[7]=v[0];m[8]=0;}
static void prop(double P[N][N],const nav_t*s,const double*f,double dt,double qg,double qa){
  double F[N][N]={{0}},T[N][N],R[N][N];
  double fn[3],S[9]; const double*C=s->C;
  for(int i=0;i<3;i++)fn[i]=C[3*i]*f[0]+C[3*i+1]*f[1]+C[3*i+2]*f[2];
  skew(fn,S); double sl=sin(s->lat),cl=cos(s->lat),re=EA+s->alt;
  double r1=s->v[1]/re,r2=-s->v[0]/re,r3=-r1*sl/cl,O1=RATE*cl,O3=-RATE*sl;
  double w[3]={O1+r1,r2,O3+r3},w2[3]={2*O1+r1,r2,2*O3+r3},W[9],W2[9];skew(w,W);skew(w2,W2);
  for(int i=0;i<N;i++)F[i][i]=1;
  for(int i=0;i<3;i++){F[i][3+i]=dt;
    for(int j=0;j<3;j++){F[3+i][3+j]-=W2[3*i+j]*dt;F[3+i][6+j]=S[3*i+j]*dt;F[6+i][6+j]-=W[3*i+j]*dt;
      F[3+i][12+j]=C[3*i+j]*dt;F[6+i][9+j]=-C[3*i+j]*dt;}}
  F[5][2]+=2*9.8/EA*dt; F[6][4]=dt/re;F[7][3]=-dt/re;
  for(int i=0;i<N;i++)for(int j=0;j<N;j++)T[i][j]=0;
  for(int i=0;i<N;i++)for(int k=0;k<N;k++){double a=F[i][k];for(int j=0;j<N;j++)T[i][j]+=a*P[k][j];}
  for(int i=0;i<N;i++)for(int j=0;j<N;j++)R[i][j]=0;
  double FT[N][N];for(int i=0;i<N;i++)for(int j=0;j<N;j++)FT[i][j]=F[j][i];
  for(int i=0;i<N;i++)for(int k=0;k<N;k++){double a=T[i][k];for(int j=0;j<N;j++)R[i][j]+=a*FT[k][j];}
  memcpy(P,R,sizeof R);
  for(int i=0;i<3;i++){P[3+i][3+i]+=qa*qa*dt;P[6+i][6+i]+=qg*qg*dt;}
}
// gnss: lat lon(rad) alt [m]; one fix each ng samples (at sample ng,2ng,...). kp = covariance propagation every kp samples
void kf_run(long n,const double*g,const double*f,double dt,const double*init15,const double*gn,int ng,int kp,
            double sd,double psd,double vsd,double lsd,double asd,double bg,double ba,double qg,double qa,double*out,double*outP){
  nav_t s; memcpy(&s,init15,sizeof s); memcpy(out,&s,sizeof s);
  double P[N][N]={{0}},b[6]={0}; 
  for(int i=0;i<3;i++){P[i][i]=psd*psd;P[3+i][3+i]=vsd*vsd;P[6+i][6+i]=(i<2?lsd*lsd:asd*asd);P[9+i][9+i]=bg*bg;P[12+i][12+i]=ba*ba;}
  double fa[3]={0};
  for(long i=0;i+1<n;i++){
    double th[3],dv[3];incr(g+3*i,g+3*i+3,f+3*i,f+3*i+3,dt,th,dv);
    for(int j=0;j<3;j++){th[j]-=b[j]*dt;dv[j]-=b[3+j]*dt;fa[j]+=dv[j];}
    step(&s,th,dv,dt);
    if((i+1)%kp==0){double ff[3]={fa[0]/(kp*dt),fa[1]/(kp*dt),fa[2]/(kp*dt)};prop(P,&s,ff,kp*dt,qg,qa);fa[0]=fa[1]=fa[2]=0;}
    if((i+1)%ng==0){
      const double*z=gn+3*((i+1)/ng-1); double x[N]={0};
      double sl=sin(s.lat),xx=1-E2*sl*sl,re=EA/sqrt(xx),rn=re*(1-E2)/xx+s.alt;re+=s.alt;
      double e[3]={(s.lat-z[0])*rn,(s.lon-z[1])*re*cos(s.lat),-(s.alt-z[2])};
      for(int m=0;m<3;m++){double K[N],S=P[m][m]+sd*sd,y=e[m]-x[m];double row[N];
        for(int j=0;j<N;j++){K[j]=P[j][m]/S;row[j]=P[m][j];}
        for(int j=0;j<N;j++){x[j]+=K[j]*y;for(int k=0;k<N;k++)P[j][k]-=K[j]*row[k];}}
      for(int j=0;j<N;j++)for(int k=0;k<j;k++){double a=0.5*(P[j][k]+P[k][j]);P[j][k]=P[k][j]=a;}
      s.lat-=x[0]/rn;s.lon-=x[1]/(re*cos(s.lat));s.alt+=x[2];
      for(int j=0;j<3;j++)s.v[j]-=x[3+j];
      double A[9],T[9];rotmat(x+6,A);mm(A,s.C,T);memcpy(s.C,T,sizeof T);
      for(int j=0;j<6;j++)b[j]+=x[9+j];
      for(int j=0;j<N;j++)outP[N*((i+1)/ng-1)+j]=P[j][j];
    }
    memcpy(out+15*(i+1),&s,sizeof s);
  }
}
