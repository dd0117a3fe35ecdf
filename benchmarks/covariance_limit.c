/* What a careful C programmer gets on one core: the covariance of a dense filter, predicted and
   changed by three observations of states, plain form, its size known to the compiler.
   gcc -O3 -march=native -fno-math-errno -mprefer-vector-width=128 -shared -fPIC */
#include <string.h>
#define FILTER(N) \
static void prop##N(double P[N][N],const double F[N][N],const double Q[N][N]){ \
  double T[N][N],R[N][N],FT[N][N]; \
  for(int i=0;i<N;i++)for(int j=0;j<N;j++)T[i][j]=0; \
  for(int i=0;i<N;i++)for(int k=0;k<N;k++){double a=F[i][k];for(int j=0;j<N;j++)T[i][j]+=a*P[k][j];} \
  for(int i=0;i<N;i++)for(int j=0;j<N;j++)R[i][j]=Q[i][j]; \
  for(int i=0;i<N;i++)for(int j=0;j<N;j++)FT[i][j]=F[j][i]; \
  for(int i=0;i<N;i++)for(int k=0;k<N;k++){double a=T[i][k];for(int j=0;j<N;j++)R[i][j]+=a*FT[k][j];} \
  memcpy(P,R,sizeof R); \
} \
/* z: 3 observations of the first three states, each with the variance r; the same in every epoch */ \
void epochs##N(long count,const double*F,const double*Q,const double*z,double r,double*P0,double*x){ \
  double (*P)[N]=(double(*)[N])P0; \
  for(long e=0;e<count;e++){ \
    prop##N(P,(const double(*)[N])F,(const double(*)[N])Q); \
    for(int m=0;m<3;m++){double K[N],S=P[m][m]+r,y=z[m]-x[m];double row[N]; \
      for(int j=0;j<N;j++){K[j]=P[j][m]/S;row[j]=P[m][j];} \
      for(int j=0;j<N;j++){x[j]+=K[j]*y;for(int k=0;k<N;k++)P[j][k]-=K[j]*row[k];}} \
    for(int j=0;j<N;j++)for(int k=0;k<j;k++){double a=0.5*(P[j][k]+P[k][j]);P[j][k]=P[k][j]=a;} \
  } \
}
FILTER(15)
FILTER(17)
