/* What a careful C programmer gets on one core: an INS/GNSS filter of 15 states, closed loop, dense
   covariance, plain form; one fix each ng samples, covariance every kp samples.
   gcc -O3 -march=native -fno-math-errno -mprefer-vector-width=128 -shared -fPIC */
#include "navigation_limit.c"
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
