/* Small known problems with SUNDIALS: known (ida|cvode) (robertson|hires|akzo_nobel|ring_modulator) TOLERANCE
   Prints CPU seconds (best of several), steps, and the values at the end.  Equations, ends and nominal values are those of
   ../../../tests/numerics; the Jacobian is written out, absolute tolerances are the relative one of the nominal values. */
#include "common.h"

#define MOST 15

typedef struct {
  const char *name;
  long n;
  double stop, start[MOST], nominal[MOST];
  void (*rates)(double t, const double *y, double *f);
  /* entries other than zero of j[row][column] */
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

static const Problem problems[] = {
    {"robertson", 3, 1e11, {1}, {1e-7, 1e-13, 1}, robertson, robertson_jacobian},
    {"hires", 8, 321.8122, {1, 0, 0, 0, 0, 0, 0, 0.0057}, {1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3}, hires, hires_jacobian},
    {"akzo_nobel", 5, 180, {0.444, 0.00123, 0, 0.007, 0}, {0.1, 1e-3, 0.1, 1e-3, 1e-2}, akzo_nobel, akzo_nobel_jacobian},
    {"ring_modulator", 15, 1e-3, {0}, {0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3},
     ring_modulator, ring_modulator_jacobian},
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
      IDASetJacFn(memory, ida_matrix);
      IDASetMaxNumSteps(memory, 100000000);
      code = IDASolve(memory, problem->stop, &t, y, yp, IDA_NORMAL);
      IDAGetNumSteps(memory, &steps);
      IDAFree(&memory);
    } else {
      CVodeInit(memory, cvode_rates, 0.0, y);
      CVodeSVtolerances(memory, tolerance, absolute);
      CVodeSetLinearSolver(memory, solver, m);
      CVodeSetJacFn(memory, cvode_matrix);
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
