/* What a careful C programmer gets on one core: increments of linear rates with coning and sculling,
   and north-east-down on the ellipsoid; n samples, every state stored.
   gcc -O3 -march=native -fno-math-errno -mprefer-vector-width=128 -shared -fPIC */
#include <math.h>
#include <string.h>
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
// gyro, accel: n x 3 rate samples. out: n x (3+3+9): lat lon alt(rad) v C
void mech_run(long n,const double*restrict g,const double*restrict f,double dt,const double*restrict init15,double*restrict out){
  nav_t s; memcpy(&s,init15,sizeof s); memcpy(out,&s,sizeof s);
  for(long i=0;i+1<n;i++){double th[3],dv[3];incr(g+3*i,g+3*i+3,f+3*i,f+3*i+3,dt,th,dv);step(&s,th,dv,dt);memcpy(out+15*(i+1),&s,sizeof s);}
}
