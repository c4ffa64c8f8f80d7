#include <math.h>

/* Functions of the language that C has under other names; NaN stays NaN. */
static inline double hyd_sign(double a) { return (a > 0) - (a < 0); }
static inline double hyd_min(double a, double b) { return a != a || b != b ? NAN : a < b ? a : b; }
static inline double hyd_max(double a, double b) { return a != a || b != b ? NAN : a > b ? a : b; }
static inline double hyd_div(double a, double b) { return trunc(a / b); }
static inline double hyd_mod(double a, double b) { return a - floor(a / b) * b; }
static inline double hyd_rem(double a, double b) { return a - trunc(a / b) * b; }
/* What is left to a call of a function: turns of its loops and bytes of stack. */
typedef struct { long turns, stack; } hyd_account;
