/* Small known problems with SUNDIALS: known (ida|cvode) (robertson|hires|akzo_nobel|ring_modulator|squeezing_mechanism) TOLERANCE
   Prints CPU seconds (best of several), steps, and the values at the end.  Equations, ends and nominal values are those of
   ../../../tests/numerics; the Jacobian is written out but for the mechanism, absolute tolerances are the relative one of the nominal values. */
#include "common.h"

#define MOST 15

typedef struct {
  const char *name;
  long n;
  double stop, start[MOST], nominal[MOST];
  void (*rates)(double t, const double *y, double *f);
  /* entries other than zero of j[row][column]; NULL: by differences */
  void (*jacobian)(double t, const double *y, double j[MOST][MOST]);
} Problem;

static void robertson(double t, const double *y, double *f) {
  (void)t;
  f[0] = -0.04 * y[0] + 1e4 * y[1] * y[2];
  f[2] = 3e7 * y[1] * y[1];
  f[1] = -f[0] - f[2];
}
static void robertson_jacobian(double t, const double *y, double j[MOST][MOST]) {
  (void)t;
  j[0][0] = -0.04, j[0][1] = 1e4 * y[2], j[0][2] = 1e4 * y[1];
  j[2][1] = 6e7 * y[1];
  j[1][0] = 0.04, j[1][1] = -j[0][1] - j[2][1], j[1][2] = -j[0][2];
}

static void hires(double t, const double *y, double *f) {
  double bind = 280 * y[5] * y[7], release = (0.43 + 0.69 + 0.69) * y[6];
  (void)t;
  f[0] = -1.71 * y[0] + 0.43 * y[1] + 8.32 * y[2] + 0.0007;
  f[1] = 1.71 * y[0] - 8.75 * y[1];
  f[2] = -10.03 * y[2] + 0.43 * y[3] + 0.035 * y[4];
  f[3] = 8.32 * y[1] + 1.71 * y[2] - 1.12 * y[3];
  f[4] = -1.745 * y[4] + 0.43 * (y[5] + y[6]);
  f[5] = -bind + 0.69 * y[3] + 1.71 * y[4] - 0.43 * y[5] + 0.69 * y[6];
  f[6] = bind - release;
  f[7] = release - bind;
}
static void hires_jacobian(double t, const double *y, double j[MOST][MOST]) {
  double a = 280 * y[7], b = 280 * y[5];
  (void)t;
  j[0][0] = -1.71, j[0][1] = 0.43, j[0][2] = 8.32;
  j[1][0] = 1.71, j[1][1] = -8.75;
  j[2][2] = -10.03, j[2][3] = 0.43, j[2][4] = 0.035;
  j[3][1] = 8.32, j[3][2] = 1.71, j[3][3] = -1.12;
  j[4][4] = -1.745, j[4][5] = j[4][6] = 0.43;
  j[5][3] = 0.69, j[5][4] = 1.71, j[5][5] = -0.43 - a, j[5][6] = 0.69, j[5][7] = -b;
  j[6][5] = a, j[6][6] = -1.81, j[6][7] = b;
  j[7][5] = -a, j[7][6] = 1.81, j[7][7] = -b;
}

/* the equilibrium y[5] = 115.83 y[0] y[3] put in */
static void akzo_nobel(double t, const double *y, double *f) {
  double root = sqrt(y[1]), e = 115.83 * y[0] * y[3];
  double r1 = 18.7 * y[0] * y[0] * y[0] * y[0] * root, r2 = 0.58 * y[2] * y[3], r3 = 0.58 / 34.4 * y[0] * y[4];
  double r4 = 0.09 * y[0] * y[3] * y[3], r5 = 0.42 * e * e * root, in = 3.3 * (0.9 / 737 - y[1]);
  (void)t;
  f[0] = -2 * r1 + r2 - r3 - r4;
  f[1] = in - 0.5 * (r1 + r5) - r4;
  f[2] = r1 - r2 + r3;
  f[3] = r3 - r2 - 2 * r4;
  f[4] = r2 - r3 + r5;
}
static void akzo_nobel_jacobian(double t, const double *y, double j[MOST][MOST]) {
  double root = sqrt(y[1]), e = 115.83 * y[0] * y[3], cube = y[0] * y[0] * y[0];
  double r1[5] = {4 * 18.7 * cube * root, 0.5 * 18.7 * cube * y[0] / root}, r2[5] = {0, 0, 0.58 * y[3], 0.58 * y[2]};
  double r3[5] = {0.58 / 34.4 * y[4], 0, 0, 0, 0.58 / 34.4 * y[0]}, r4[5] = {0.09 * y[3] * y[3], 0, 0, 0.18 * y[0] * y[3]};
  double r5[5] = {0.84 * e * 115.83 * y[3] * root, 0.21 * e * e / root, 0, 0.84 * e * 115.83 * y[0] * root};
  (void)t;
  for (int k = 0; k < 5; k++) {
    j[0][k] = -2 * r1[k] + r2[k] - r3[k] - r4[k];
    j[1][k] = (k == 1 ? -3.3 : 0) - 0.5 * (r1[k] + r5[k]) - r4[k];
    j[2][k] = r1[k] - r2[k] + r3[k];
    j[3][k] = r3[k] - r2[k] - 2 * r4[k];
    j[4][k] = r2[k] - r3[k] + r5[k];
  }
}

#define C 1.6e-8
#define CS 2e-12
#define CP 1e-8
#define LH 4.45
#define LS1 2e-3
#define LS2 5e-4
static const double combination[4][7] = {
    {0, 0, 1, 0, -1, 0, -1}, {0, 0, 0, -1, 0, 1, -1}, {0, 0, 0, 1, 1, 0, 1}, {0, 0, -1, 0, 0, -1, 1}};
static const double carrier_sign[4] = {-1, -1, 1, 1};
static double diode(int k, double carrier, const double *y, double *slope) {
  double sum = carrier_sign[k] * carrier;
  for (int c = 2; c < 7; c++) sum += combination[k][c] * y[c];
  double e = 40.67286402e-9 * exp(17.7493332 * sum);
  *slope = 17.7493332 * e;
  return e - 40.67286402e-9;
}
static void ring_modulator(double t, const double *y, double *f) {
  double d[4], slope, carrier = 2 * sin(2e4 * M_PI * t), signal = 0.5 * sin(2e3 * M_PI * t);
  const double *u = y, *i = y + 7;
  for (int k = 0; k < 4; k++) d[k] = diode(k, carrier, y, &slope);
  f[0] = (i[0] - 0.5 * i[2] + 0.5 * i[3] + i[6] - u[0] / 25e3) / C;
  f[1] = (i[1] - 0.5 * i[4] + 0.5 * i[5] + i[7] - u[1] / 25e3) / C;
  f[2] = (i[2] - d[0] + d[3]) / CS;
  f[3] = (-i[3] + d[1] - d[2]) / CS;
  f[4] = (i[4] + d[0] - d[2]) / CS;
  f[5] = (-i[5] - d[1] + d[3]) / CS;
  f[6] = (d[0] + d[1] - d[2] - d[3] - u[6] / 50) / CP;
  f[7] = -u[0] / LH;
  f[8] = -u[1] / LH;
  f[9] = (0.5 * u[0] - u[2] - 17.3 * i[2]) / LS2;
  f[10] = (u[3] - 0.5 * u[0] - 17.3 * i[3]) / LS2;
  f[11] = (0.5 * u[1] - u[4] - 17.3 * i[4]) / LS2;
  f[12] = (u[5] - 0.5 * u[1] - 17.3 * i[5]) / LS2;
  f[13] = (signal - u[0] - 86.3 * i[6]) / LS1;
  f[14] = (-u[1] - 636.3 * i[7]) / LS1;
}
static void ring_modulator_jacobian(double t, const double *y, double j[MOST][MOST]) {
  static const double share[5][4] = {{-1, 0, 0, 1}, {0, 1, -1, 0}, {1, 0, -1, 0}, {0, -1, 0, 1}, {1, 1, -1, -1}};
  double slope[4], carrier = 2 * sin(2e4 * M_PI * t);
  for (int k = 0; k < 4; k++) diode(k, carrier, y, &slope[k]);
  for (int row = 2; row < 7; row++)
    for (int c = 2; c < 7; c++) {
      double sum = 0;
      for (int k = 0; k < 4; k++) sum += share[row - 2][k] * slope[k] * combination[k][c];
      j[row][c] = sum / (row == 6 ? CP : CS);
    }
  j[6][6] -= 1 / (50 * CP);
  j[0][0] = j[1][1] = -1 / (25e3 * C);
  j[0][7] = j[1][8] = j[0][13] = j[1][14] = 1 / C;
  j[0][9] = j[1][11] = -0.5 / C, j[0][10] = j[1][12] = 0.5 / C;
  j[2][9] = j[4][11] = 1 / CS, j[3][10] = j[5][12] = -1 / CS;
  j[7][0] = j[8][1] = -1 / LH;
  j[9][0] = j[11][1] = 0.5 / LS2, j[10][0] = j[12][1] = -0.5 / LS2;
  j[9][2] = j[11][4] = -1 / LS2, j[10][3] = j[12][5] = 1 / LS2;
  j[9][9] = j[10][10] = j[11][11] = j[12][12] = -17.3 / LS2;
  j[13][0] = j[14][1] = -1 / LS1, j[13][13] = -86.3 / LS1, j[14][14] = -636.3 / LS1;
}

/* Andrews' mechanism as an ordinary system of angles and speeds: the accelerations follow from the equations of motion and the joints'
   equations differentiated twice, 13 linear equations solved at each call.  No Jacobian: SUNDIALS differences. */
static const double mass[7] = {0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498};
static const double inertia[7] = {2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5};
static void solve(double a[13][14]) {
  for (int k = 0; k < 13; k++) {
    int pivot = k;
    for (int row = k + 1; row < 13; row++)
      if (fabs(a[row][k]) > fabs(a[pivot][k])) pivot = row;
    if (pivot != k)
      for (int c = k; c < 14; c++) {
        double kept = a[k][c];
        a[k][c] = a[pivot][c], a[pivot][c] = kept;
      }
    for (int row = k + 1; row < 13; row++) {
      double factor = a[row][k] / a[k][k];
      if (factor != 0)
        for (int c = k + 1; c < 14; c++) a[row][c] -= factor * a[k][c];
    }
  }
  for (int k = 12; k >= 0; k--) {
    for (int c = k + 1; c < 13; c++) a[k][13] -= a[k][c] * a[c][13];
    a[k][13] /= a[k][k];
  }
}
static void squeezing_mechanism(double t, const double *z, double *f) {
  const double xb = -0.03635, yb = 0.03273, xc = 0.014, yc = 0.072, d = 0.028, da = 0.0115, e = 0.02, rr = 0.007, ra = 0.00092;
  const double ss = 0.035, sa = 0.01874, sb = 0.01043, sc = 0.018, sd = 0.02, ta = 0.02308, tb = 0.00916, u = 0.04, ua = 0.01228;
  const double ub = 0.00449, zf = 0.02, zt = 0.04, c0 = 4530, l0 = 0.07785, torque = 0.033, e4 = 0.02 - 0.01421, e6 = 0.02 - 0.01421;
  const double *m = mass, *J = inertia, *w = z + 7;
  double sbe = sin(z[0]), cbe = cos(z[0]), sbt = sin(z[0] + z[1]), cbt = cos(z[0] + z[1]), sth = sin(z[1]), cth = cos(z[1]);
  double sga = sin(z[2]), cga = cos(z[2]), sph = sin(z[3]), cph = cos(z[3]), sde = sin(z[4]), cde = cos(z[4]);
  double spd = sin(z[3] + z[4]), cpd = cos(z[3] + z[4]), som = sin(z[5]), com = cos(z[5]), sep = sin(z[6]), cep = cos(z[6]);
  double soe = sin(z[5] + z[6]), coe = cos(z[5] + z[6]);
  double xd = sd * cga + sc * sga + xb, yd = sd * sga - sc * cga + yb, dx = xd - xc, dy = yd - yc;
  double length = sqrt(dx * dx + dy * dy), pull = c0 * (l0 / length - 1);
  double w12 = w[0] + w[1], w45 = w[3] + w[4], w67 = w[5] + w[6], a[13][14] = {{0}};
  (void)t;
  a[0][0] = m[0] * ra * ra + m[1] * (rr * rr - 2 * da * rr * cth + da * da) + J[0] + J[1];
  a[0][1] = a[1][0] = m[1] * (da * da - da * rr * cth) + J[1];
  a[1][1] = m[1] * da * da + J[1];
  a[2][2] = m[2] * (sa * sa + sb * sb) + J[2];
  a[3][3] = m[3] * e4 * e4 + J[3];
  a[3][4] = a[4][3] = m[3] * (e4 * e4 + zt * e4 * sph) + J[3];
  a[4][4] = m[3] * (zt * zt + 2 * zt * e4 * sph + e4 * e4) + m[4] * (ta * ta + tb * tb) + J[3] + J[4];
  a[5][5] = m[5] * e6 * e6 + J[5];
  a[5][6] = a[6][5] = m[5] * (e6 * e6 - u * e6 * som) + J[5];
  a[6][6] = m[5] * (e6 * e6 - 2 * u * e6 * som + u * u) + m[6] * (ua * ua + ub * ub) + J[5] + J[6];
  a[0][13] = torque - m[1] * da * rr * w[1] * (w[1] + 2 * w[0]) * sth;
  a[1][13] = m[1] * da * rr * w[0] * w[0] * sth;
  a[2][13] = pull * (dx * (sc * cga - sd * sga) + dy * (sd * cga + sc * sga));
  a[3][13] = m[3] * zt * e4 * w[4] * w[4] * cph;
  a[4][13] = -m[3] * zt * e4 * w[3] * (w[3] + 2 * w[4]) * cph;
  a[5][13] = -m[5] * u * e6 * w[6] * w[6] * com;
  a[6][13] = m[5] * u * e6 * w[5] * (w[5] + 2 * w[6]) * com;
  double qx = -rr * cbe * w[0] * w[0] + d * cbt * w12 * w12, qy = -rr * sbe * w[0] * w[0] + d * sbt * w12 * w12;
  double by_beta[2] = {-rr * sbe + d * sbt, rr * cbe - d * cbt}, by_theta[2] = {d * sbt, -d * cbt};
  double *g[6];
  for (int k = 0; k < 6; k++) {
    g[k] = a[7 + k];
    g[k][0] = by_beta[k % 2], g[k][1] = by_theta[k % 2];
    g[k][13] = -(k % 2 ? qy : qx);
  }
  g[0][2] = -ss * cga, g[0][13] -= ss * sga * w[2] * w[2];
  g[1][2] = -ss * sga, g[1][13] += ss * cga * w[2] * w[2];
  g[2][3] = -e * cpd, g[2][4] = -e * cpd + zt * sde, g[2][13] -= e * spd * w45 * w45 + zt * cde * w[4] * w[4];
  g[3][3] = -e * spd, g[3][4] = -e * spd - zt * cde, g[3][13] += e * cpd * w45 * w45 - zt * sde * w[4] * w[4];
  g[4][5] = zf * soe, g[4][6] = zf * soe - u * cep, g[4][13] -= zf * coe * w67 * w67 + u * sep * w[6] * w[6];
  g[5][5] = -zf * coe, g[5][6] = -zf * coe - u * sep, g[5][13] -= zf * soe * w67 * w67 - u * cep * w[6] * w[6];
  for (int k = 0; k < 6; k++)
    for (int c = 0; c < 7; c++) a[c][7 + k] = g[k][c];
  solve(a);
  for (int k = 0; k < 7; k++) f[k] = w[k], f[7 + k] = a[k][13];
}

static const Problem problems[] = {
    {"robertson", 3, 1e11, {1}, {1e-7, 1e-13, 1}, robertson, robertson_jacobian},
    {"hires", 8, 321.8122, {1, 0, 0, 0, 0, 0, 0, 0.0057}, {1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3}, hires, hires_jacobian},
    {"akzo_nobel", 5, 180, {0.444, 0.00123, 0, 0.007, 0}, {0.1, 1e-3, 0.1, 1e-3, 1e-2}, akzo_nobel, akzo_nobel_jacobian},
    {"ring_modulator", 15, 1e-3, {0}, {0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3},
     ring_modulator, ring_modulator_jacobian},
    {"squeezing_mechanism", 14, 0.03,
     {-0.0617138900142764496, 0, 0.455279819163070380, 0.222668390165885885, 0.487364979543842550, -0.222668390165885885, 1.23054744454982119},
     {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}, squeezing_mechanism, NULL},
};
static const Problem *problem;

/* sign (c I - df/dy) */
static void matrix(double t, const double *y, double c, double sign, SUNMatrix m) {
  double j[MOST][MOST];
  memset(j, 0, sizeof j);
  problem->jacobian(t, y, j);
  for (long col = 0; col < problem->n; col++)
    for (long row = 0; row < problem->n; row++) SM_ELEMENT_D(m, row, col) = sign * ((row == col ? c : 0) - j[row][col]);
}

int main(int argc, char **argv) {
  if (argc < 4) return 2;
  for (size_t k = 0; k < sizeof problems / sizeof *problems; k++)
    if (!strcmp(argv[2], problems[k].name)) problem = &problems[k];
  if (!problem) return 2;
  int ida = !strcmp(argv[1], "ida");
  rates = problem->rates;
  double tolerance = atof(argv[3]), best = 1e30, spent = 0;
  long n = problem->n, steps = 0;
  SUNContext context;
  SUNContext_Create(NULL, &context);
  N_Vector y = N_VNew_Serial(n, context), yp = N_VNew_Serial(n, context), absolute = N_VNew_Serial(n, context);
  for (long k = 0; k < n; k++) AT(absolute)[k] = tolerance * problem->nominal[k];
  for (int run = 0; run == 0 || (spent < 1.0 && run < 50); run++) {
    memcpy(AT(y), problem->start, n * sizeof(double));
    rates(0.0, AT(y), AT(yp));
    double begin = cpu(), t;
    SUNMatrix m = SUNDenseMatrix(n, n, context);
    SUNLinearSolver solver = SUNLinSol_Dense(y, m, context);
    void *memory = ida ? IDACreate(context) : CVodeCreate(CV_BDF, context);
    int code;
    if (ida) {
      IDAInit(memory, ida_residual, 0.0, y, yp);
      IDASVtolerances(memory, tolerance, absolute);
      IDASetLinearSolver(memory, solver, m);
      if (problem->jacobian) IDASetJacFn(memory, ida_matrix);
      IDASetMaxNumSteps(memory, 100000000);
      code = IDASolve(memory, problem->stop, &t, y, yp, IDA_NORMAL);
      IDAGetNumSteps(memory, &steps);
      IDAFree(&memory);
    } else {
      CVodeInit(memory, cvode_rates, 0.0, y);
      CVodeSVtolerances(memory, tolerance, absolute);
      CVodeSetLinearSolver(memory, solver, m);
      if (problem->jacobian) CVodeSetJacFn(memory, cvode_matrix);
      CVodeSetMaxNumSteps(memory, 100000000);
      code = CVode(memory, problem->stop, y, &t, CV_NORMAL);
      CVodeGetNumSteps(memory, &steps);
      CVodeFree(&memory);
    }
    SUNLinSolFree(solver);
    SUNMatDestroy(m);
    if (code < 0) {
      fprintf(stderr, "failed: %d\n", code);
      return 1;
    }
    double seconds = cpu() - begin;
    best = fmin(best, seconds);
    spent += seconds;
  }
  printf("%.9f %ld", best, steps);
  for (long k = 0; k < n; k++) printf(" %.17g", AT(y)[k]);
  printf("\n");
  return 0;
}
