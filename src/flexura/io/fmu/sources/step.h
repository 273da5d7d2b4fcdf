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
   powers of two that balance A. */
typedef struct {
    int states, inputs, outputs, blocks, largest, squares;
    Rows A, B, C, D;
    const int *first, *member, *offset, *place;
    const double *scale, *start, *nominal;
} Model;

extern const Model flexura_model;

/* Row i of a matrix times a vector. */
double flexura_row(const Rows *matrix, int i, const double *vector);

/* E = exp(A h) and G = integral of exp(A s) over 0 <= s <= h, per block, row by row; `work` holds 5 * largest^2 numbers.
   Returns 0 when a number is not finite. */
int flexura_hold(const Model *model, double h, double *E, double *G, double *work);

/* One step with u held; `work` holds 2 * largest numbers. */
void flexura_step(const Model *model, const double *E, const double *G, const double *u, double *x, double *work);

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
