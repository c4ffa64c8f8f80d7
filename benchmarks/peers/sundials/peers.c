/* Three problems with SUNDIALS: peers (ida|cvode) (drive|line|cord) TOLERANCE CELLS MAXORDER [FILE]
   Prints CPU seconds (best of several), steps, rejected steps; writes samples `t,value,...` to FILE. */
#include "common.h"
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_sparse.h>

typedef void (*column_fn)(double t, const double *y, long c, int *count, long *rows, double *values);

static long cells;

/* line: q_1, p_1, q_2, p_2, ... in L/s and MPa */
static double line_c(void) { return 870.0 * 1300.0 * 1300.0 * 1e-9 / (M_PI * 3.6e-5 * 20.0 / cells); }
static double line_i(void) { return M_PI * 3.6e-5 / (870.0 * 20.0 / cells) * 1e9; }
static double line_r(void) { return 0.03 / (2 * 0.012 * M_PI * 3.6e-5) * 1e-3; }
static double valve(double t) {
  double s = fmin(1.0, fmax(0.0, (t - 0.01) / 0.02));
  return 2e-3 * sqrt(2.0 / 870.0 * 1e6) * (1.0 - 0.99 * s * s * s * (10 - 15 * s + 6 * s * s));
}
static void line_rates(double t, const double *y, double *f) {
  double c = line_c(), i = line_i(), r = line_r(), left = 20.0, d = y[2 * cells - 1] - 0.1;
  double out = valve(t) * d / sqrt(sqrt(d * d + 1e-6));
  for (long k = 0; k < cells; k++) {
    double q = y[2 * k], p = y[2 * k + 1], next = k + 1 < cells ? y[2 * k + 2] : out;
    f[2 * k] = i * (left - p) - r * q * fabs(q);
    f[2 * k + 1] = c * (q - next);
    left = p;
  }
}
static void put(int *count, long *rows, double *values, long row, double value) {
  rows[*count] = row;
  values[(*count)++] = value;
}
static void line_column(double t, const double *y, long col, int *n, long *rows, double *v) {
  double c = line_c(), i = line_i();
  long k = col / 2;
  *n = 0;
  if (col % 2 == 0) {
    if (k > 0) put(n, rows, v, col - 1, -c);
    put(n, rows, v, col, -2 * line_r() * fabs(y[col]));
    put(n, rows, v, col + 1, c);
  } else {
    double d = y[col] - 0.1, s = d * d + 1e-6, root = sqrt(sqrt(s));
    put(n, rows, v, col - 1, -i);
    put(n, rows, v, col, k + 1 == cells ? -c * valve(t) * (1 / root - 0.5 * d * d / (s * root)) : 0.0);
    if (k + 1 < cells) put(n, rows, v, col + 1, i);
  }
}
static void line_start(double *y) {
  double q = 0.42446595738526294, drop = line_r() / line_i() * q * q;
  for (long k = 0; k < cells; k++) {
    y[2 * k] = q;
    y[2 * k + 1] = 20.0 - (k + 1) * drop;
  }
}

/* cord: y_1, v_1, y_2, v_2, ... */
static void cord_rates(double t, const double *y, double *f) {
  double s = (cells + 1.0) * (cells + 1.0);
  (void)t;
  for (long k = 0; k < cells; k++) {
    double left = k > 0 ? y[2 * k - 2] : 0.0, right = k + 1 < cells ? y[2 * k + 2] : 0.0;
    f[2 * k] = y[2 * k + 1];
    f[2 * k + 1] = s * (left - 2 * y[2 * k] + right);
  }
}
static void cord_column(double t, const double *y, long col, int *n, long *rows, double *v) {
  double s = (cells + 1.0) * (cells + 1.0);
  (void)t, (void)y;
  *n = 0;
  if (col % 2 == 0) {
    if (col > 0) put(n, rows, v, col - 1, s);
    put(n, rows, v, col, 0.0);
    put(n, rows, v, col + 1, -2 * s);
    if (col + 3 < 2 * cells) put(n, rows, v, col + 3, s);
  } else {
    put(n, rows, v, col - 1, 1.0);
    put(n, rows, v, col, 0.0);
  }
}
static void cord_start(double *y) {
  for (long k = 0; k < cells; k++) {
    y[2 * k] = sin(M_PI * (k + 1) / (cells + 1.0));
    y[2 * k + 1] = 0;
  }
}

/* drive: states of models/drive.hyd */
static double contact(double depth, double speed, double k) { return depth <= 0 ? 0 : fmax(0, k * depth * (1 + 0.5 * speed)); }
static double orifice(double area, double dp) {
  return 0.65 * area * sqrt(2.0 / 870.0 * 1e6) * 1e3 * dp / sqrt(sqrt(dp * dp + 1e-4));
}
static void drive_rates(double t, const double *z, double *f) {
  double x = z[2] * 1e-3, y = z[5] * 1e-3, area = M_PI / 4 * 1e-4;
  double gap = 0.762e-3 + 0.45e-3 - x, l = 1.2193e-5 / gap, dl = 1.2193e-5 / (gap * gap);
  double spool = contact(-x, -z[3], 2e7) - contact(x - 0.45e-3, z[3], 2e7);
  double piston = contact(-y, -z[6], 1e8) - contact(y - 8e-3, z[6], 2e7);
  double in = orifice(M_PI * 8e-3 * fmax(0, x - 0.05e-3) + 1e-9, z[7] - z[4]);
  double out = orifice(M_PI * 8e-3 * fmax(0, 0.4e-3 - x) + 1e-9, z[4] - 0.1);
  (void)t;
  f[0] = -z[1] * 1e3;
  f[1] = (z[0] - 6 * z[1] - dl * z[3] * z[1]) / l;
  f[2] = z[3] * 1e3;
  f[3] = (0.5 * z[1] * z[1] * dl - 20 - 10 * z[2] - 5 * z[3] + spool) / 0.03;
  f[4] = 1.4 / (5e-6 + area * y) * (in - out - area * z[6] * 1e3);
  f[5] = z[6] * 1e3;
  f[6] = (area * (z[4] - 0.1) * 1e6 - 250 - 30 * z[5] - 20 * z[6] + piston) / 0.15;
  f[7] = 1.4 / 2e-4 * (orifice(2e-5, 10 - z[7]) - in);
}
static void drive_start(double *y) {
  const double start[8] = {48, 0, 0, 0, 0.1, 0, 0, 10};
  memcpy(y, start, sizeof start);
}

static column_fn column;

/* sign (c I - df/dy) in compressed columns; every column of the problems holds its diagonal */
static void matrix(double t, const double *y, double c, double sign, SUNMatrix m) {
  sunindextype *starts = SM_INDEXPTRS_S(m), *rows = SM_INDEXVALS_S(m);
  double *data = SM_DATA_S(m), values[4];
  long entries = 0, found[4];
  int count;
  for (long col = 0; col < 2 * cells; col++) {
    starts[col] = entries;
    column(t, y, col, &count, found, values);
    for (int k = 0; k < count; k++, entries++) {
      rows[entries] = found[k];
      data[entries] = sign * ((found[k] == col ? c : 0.0) - values[k]);
    }
  }
  starts[2 * cells] = entries;
}

int main(int argc, char **argv) {
  if (argc < 6) return 2;
  int ida = !strcmp(argv[1], "ida"), drive = !strcmp(argv[2], "drive"), line = !strcmp(argv[2], "line");
  double tolerance = atof(argv[3]), stop = drive ? 0.08 : line ? 0.1 : 5.0;
  int order = atoi(argv[5]), samples = drive ? 80 : 50;
  cells = atol(argv[4]);
  long n = drive ? 8 : 2 * cells, steps = 0, rejected = 0;
  rates = drive ? drive_rates : line ? line_rates : cord_rates;
  column = line ? line_column : cord_column;
  SUNContext context;
  SUNContext_Create(NULL, &context);
  N_Vector y = N_VNew_Serial(n, context), yp = N_VNew_Serial(n, context);
  FILE *file = argc > 6 ? fopen(argv[6], "w") : NULL;
  double best = 1e30, spent = 0;
  const char *once = getenv("ONCE"); /* what the first run of a process costs */
  for (int run = 0; run == 0 || (!once && spent < 1.0 && run < 20); run++) {
    (drive ? drive_start : line ? line_start : cord_start)(AT(y));
    rates(0.0, AT(y), AT(yp));
    double begin = cpu(), t;
    SUNMatrix m = drive ? SUNDenseMatrix(n, n, context) : SUNSparseMatrix(n, n, 4 * n, CSC_MAT, context);
    SUNLinearSolver solver = drive ? SUNLinSol_Dense(y, m, context) : SUNLinSol_KLU(y, m, context);
    void *memory = ida ? IDACreate(context) : CVodeCreate(CV_BDF, context);
    if (ida) {
      IDAInit(memory, ida_residual, 0.0, y, yp);
      IDASStolerances(memory, tolerance, 0.01 * tolerance);
      IDASetLinearSolver(memory, solver, m);
      if (!drive) IDASetJacFn(memory, ida_matrix);
      IDASetMaxNumSteps(memory, 100000000);
      IDASetMaxOrd(memory, order);
    } else {
      CVodeInit(memory, cvode_rates, 0.0, y);
      CVodeSStolerances(memory, tolerance, 0.01 * tolerance);
      CVodeSetLinearSolver(memory, solver, m);
      if (!drive) CVodeSetJacFn(memory, cvode_matrix);
      CVodeSetMaxNumSteps(memory, 100000000);
      CVodeSetMaxOrd(memory, order);
    }
    for (int k = 1; k <= samples; k++) {
      double at = stop * k / samples;
      int code = ida ? IDASolve(memory, at, &t, y, yp, IDA_NORMAL) : CVode(memory, at, y, &t, CV_NORMAL);
      if (code < 0) {
        fprintf(stderr, "failed: %d\n", code);
        return 1;
      }
      if (run == 0 && file) {
        const double *v = AT(y);
        fprintf(file, "%.17g", at);
        if (drive)
          for (long j = 0; j < n; j++) fprintf(file, ",%.17g", v[j]);
        else
          fprintf(file, ",%.17g,%.17g,%.17g", v[0], v[2 * (cells / 2 - 1) + line], v[n - 2 + line]);
        fprintf(file, "\n");
      }
    }
    double seconds = cpu() - begin;
    best = fmin(best, seconds);
    spent += seconds;
    if (ida) {
      IDAGetNumSteps(memory, &steps);
      IDAGetNumErrTestFails(memory, &rejected);
      IDAFree(&memory);
    } else {
      CVodeGetNumSteps(memory, &steps);
      CVodeGetNumErrTestFails(memory, &rejected);
      CVodeFree(&memory);
    }
    SUNLinSolFree(solver);
    SUNMatDestroy(m);
  }
  if (file) fclose(file);
  printf("%.6f %ld %ld\n", best, steps, rejected);
  return 0;
}
