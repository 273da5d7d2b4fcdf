/* Linear model x' = A x + B u, y = C x + D u with A in diagonal blocks, and its exact step for held inputs. */
#ifndef FLEXURA_STEP_H
#define FLEXURA_STEP_H

#if defined(__GNUC__)
#pragma GCC visibility push(hidden)
#endif

/* A matrix by the nonzeros of its rows: those of row i are start[i] .. start[i + 1] - 1. */
typedef struct {
    const int *start;
    const int *column;
    const double *value;
} Rows;

/* Block k of A couples the states member[first[k]] .. member[first[k + 1] - 1] and no others; its square matrices
   stand at offset[k] of arrays of `squares` numbers, and place[i] is where state i stands in its block. `scale` are
   powers of two that balance A. With dt > 0 A and B are of a step, else of a rate of change.

   Parameters act through ports: x' = A x + B u + into w, y = C x + D u + onto w, z = of_states x + of_inputs u
   + around w, and w[k] = slope[k] (p[parameter[k]] - start[parameter[k]]) z[k]. A to D have an entry wherever a
   parameter makes one. */
typedef struct {
    int states, inputs, outputs, blocks, largest, squares, parameters, ports;
    double dt;
    Rows A, B, C, D, into, onto, of_states, of_inputs, around;
    const int *first, *member, *offset, *place, *parameter;
    const double *scale, *nominal, *slope, *start;
} Model;

extern const Model flexura_model;

/* Row i of a matrix times a vector. */
double flexura_row(const Rows *matrix, int i, const double *vector);

/* E = exp(A h) and G = integral of exp(A s) over 0 <= s <= h, per block, row by row; `work` holds 5 * largest^2 numbers.
   Returns 0 when a number is not finite. */
int flexura_hold(const Model *model, double h, double *E, double *G, double *work);

/* One step with u held; `work` holds 2 * largest numbers. */
void flexura_step(const Model *model, const double *E, const double *G, const double *u, double *x, double *work);

/* Ports for values p of the parameters: d = slope (p - start), and X = (1 - d around)^-1, row by row, so that
   w = X d z where no w is in z; `work` holds ports^2 numbers. Returns 0 where they have no solution. */
int flexura_ports(const Model *model, const double *p, double *d, double *X, double *work);

/* Entries of base + left X d right into `value`; `work` holds ports numbers and one for each column. */
void flexura_tuned(const Model *model, const Rows *base, int rows, const Rows *left, const Rows *right, int columns,
                   const double *d, const double *X, double *value, double *work);

/* dw for changes dd of d at given x and u; `work` holds 2 * ports numbers. */
void flexura_tuning(const Model *model, const double *x, const double *u, const double *d, const double *X,
                    const double *dd, double *dw, double *work);

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
