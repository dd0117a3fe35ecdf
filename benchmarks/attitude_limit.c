// What a careful C programmer gets on one core: exact rotation-vector quaternion update, the
// quaternion stored at each sample. gcc -O3 -march=native -fno-math-errno -shared -fPIC
#include <math.h>

// g: n x 3 rad/s; q: (n + 1) x 4 with q[0] set
void att_exact(long n, const double *g, double dt, double *q) {
  double a = q[0], b = q[1], c = q[2], d = q[3];
  for (long i = 0; i < n; i++) {
    double x = g[3 * i] * dt, y = g[3 * i + 1] * dt, z = g[3 * i + 2] * dt;
    double n2 = x * x + y * y + z * z, nn = sqrt(n2), h = 0.5 * nn;
    double s = nn > 1e-12 ? sin(h) / nn : 0.5, w = cos(h);
    x *= s;
    y *= s;
    z *= s;
    double A = a * w - b * x - c * y - d * z, B = a * x + b * w + c * z - d * y;
    double C = a * y - b * z + c * w + d * x, D = a * z + b * y - c * x + d * w;
    a = A;
    b = B;
    c = C;
    d = D;
    q[4 * i + 4] = a;
    q[4 * i + 5] = b;
    q[4 * i + 6] = c;
    q[4 * i + 7] = d;
  }
}
