#include "step.h"

#include <math.h>
#include <string.h>

#define DEGREE 18
#define SINGULAR 1e-12

double flexura_row(const Rows *matrix, int i, const double *vector)
{
    double sum = 0.0;
    for (int k = matrix->start[i]; k < matrix->start[i + 1]; k++)
        sum += matrix->value[k] * vector[matrix->column[k]];
    return sum;
}

/* out = a b, all b x b and apart from each other. */
static void multiply(int b, const double *left, const double *right, double *out)
{
    memset(out, 0, sizeof(double) * (size_t)b * (size_t)b);
    for (int i = 0; i < b; i++)
        for (int k = 0; k < b; k++) {
            const double factor = left[i * b + k];
            if (factor != 0.0)
                for (int j = 0; j < b; j++)
                    out[i * b + j] += factor * right[k * b + j];
        }
}

/* Z = scale^-1 A scale h of a block; returns its infinity norm. */
static double gather(const Model *model, int block, double h, double *Z)
{
    const int first = model->first[block], b = model->first[block + 1] - first;
    double norm = 0.0;
    memset(Z, 0, sizeof(double) * (size_t)b * (size_t)b);
    for (int i = 0; i < b; i++) {
        const int row = model->member[first + i];
        double sum = 0.0;
        for (int k = model->A.start[row]; k < model->A.start[row + 1]; k++) {
            const int column = model->A.column[k];
            const int j = model->place[column];
            Z[i * b + j] = model->A.value[k] * h * (model->scale[column] / model->scale[row]);
            sum += fabs(Z[i * b + j]);
        }
        if (!(sum <= norm))
            norm = sum;
    }
    return norm;
}

/* F = sum of Z^k / (k + 1)!, so that exp Z = 1 + Z F, for a small Z; then doubled `doublings` times. */
static void integrate(int b, int doublings, const double *Z, double *E, double *F, double *work)
{
    const int size = b * b;
    memset(F, 0, sizeof(double) * (size_t)size);
    for (int i = 0; i < b; i++)
        F[i * b + i] = 1.0;
    for (int k = DEGREE; k > 1; k--) {
        multiply(b, Z, F, work);
        for (int i = 0; i < size; i++)
            F[i] = work[i] / k;
        for (int i = 0; i < b; i++)
            F[i * b + i] += 1.0;
    }
    multiply(b, Z, F, E); /* E - 1, which keeps its digits while it is small */
    for (; doublings > 0; doublings--) {
        multiply(b, E, F, work);
        for (int i = 0; i < size; i++)
            F[i] += 0.5 * work[i];
        multiply(b, E, E, work);
        for (int i = 0; i < size; i++)
            E[i] = 2.0 * E[i] + work[i];
    }
    for (int i = 0; i < b; i++)
        E[i * b + i] += 1.0;
}

int flexura_hold(const Model *model, double h, double *E, double *G, double *work)
{
    double *Z = work, *rest = work + (size_t)model->largest * (size_t)model->largest;
    int finite = 1;
    for (int block = 0; block < model->blocks; block++) {
        const int first = model->first[block], b = model->first[block + 1] - first;
        double *own_E = E + model->offset[block], *own_G = G + model->offset[block];
        const double norm = gather(model, block, h, Z);
        int exponent = 0;
        if (!isfinite(norm))
            return 0;
        frexp(norm, &exponent);
        const int doublings = exponent > 0 ? exponent : 0;
        for (int i = 0; i < b * b; i++)
            Z[i] = ldexp(Z[i], -doublings);
        integrate(b, doublings, Z, own_E, own_G, rest);
        for (int i = 0; i < b; i++)
            for (int j = 0; j < b; j++) {
                const double back = model->scale[model->member[first + i]] / model->scale[model->member[first + j]];
                own_E[i * b + j] *= back;
                own_G[i * b + j] *= back * h;
                finite = finite && isfinite(own_E[i * b + j]) && isfinite(own_G[i * b + j]);
            }
    }
    return finite;
}

void flexura_step(const Model *model, const double *E, const double *G, const double *u, double *x, double *work)
{
    double *before = work, *drive = work + model->largest;
    for (int block = 0; block < model->blocks; block++) {
        const int first = model->first[block], b = model->first[block + 1] - first;
        const double *own_E = E + model->offset[block], *own_G = G + model->offset[block];
        for (int i = 0; i < b; i++) {
            before[i] = x[model->member[first + i]];
            drive[i] = flexura_row(&model->B, model->member[first + i], u);
        }
        for (int i = 0; i < b; i++) {
            double sum = 0.0;
            for (int j = 0; j < b; j++)
                sum += own_E[i * b + j] * before[j] + own_G[i * b + j] * drive[j];
            x[model->member[first + i]] = sum;
        }
    }
}

int flexura_ports(const Model *model, const double *p, double *d, double *X, double *work)
{
    const int r = model->ports;
    memset(X, 0, sizeof(double) * (size_t)r * (size_t)r);
    memset(work, 0, sizeof(double) * (size_t)r * (size_t)r);
    for (int i = 0; i < r; i++) {
        const int k = model->parameter[i];
        d[i] = model->slope[i] * (p[k] - model->start[k]);
        X[i * r + i] = work[i * r + i] = 1.0;
        for (int j = model->around.start[i]; j < model->around.start[i + 1]; j++)
            work[i * r + model->around.column[j]] -= d[i] * model->around.value[j];
    }
    for (int c = 0; c < r; c++) { /* Gauss and Jordan, with row exchanges */
        int best = c;
        for (int i = c + 1; i < r; i++)
            if (fabs(work[i * r + c]) > fabs(work[best * r + c]))
                best = i;
        const double pivot = work[best * r + c];
        if (!(fabs(pivot) > SINGULAR) || !isfinite(pivot))
            return 0;
        for (int j = 0; j < r; j++) {
            const double left = work[best * r + j], right = X[best * r + j];
            work[best * r + j] = work[c * r + j];
            X[best * r + j] = X[c * r + j];
            work[c * r + j] = left / pivot;
            X[c * r + j] = right / pivot;
        }
        for (int i = 0; i < r; i++) {
            const double factor = work[i * r + c];
            if (i != c && factor != 0.0)
                for (int j = 0; j < r; j++) {
                    work[i * r + j] -= factor * work[c * r + j];
                    X[i * r + j] -= factor * X[c * r + j];
                }
        }
    }
    return 1;
}

/* out += factor times row i of a matrix. */
static void add_row(const Rows *matrix, int i, double factor, double *out)
{
    for (int k = matrix->start[i]; k < matrix->start[i + 1]; k++)
        out[matrix->column[k]] += factor * matrix->value[k];
}

void flexura_tuned(const Model *model, const Rows *base, int rows, const Rows *left, const Rows *right, int columns,
                   const double *d, const double *X, double *value, double *work)
{
    const int r = model->ports;
    double *load = work, *row = work + r;
    for (int i = 0; i < rows; i++) {
        memset(load, 0, sizeof(double) * (size_t)r);
        memset(row, 0, sizeof(double) * (size_t)columns);
        for (int k = left->start[i]; k < left->start[i + 1]; k++)
            for (int j = 0; j < r; j++)
                load[j] += left->value[k] * X[left->column[k] * r + j];
        for (int j = 0; j < r; j++)
            if (load[j] != 0.0 && d[j] != 0.0)
                add_row(right, j, load[j] * d[j], row);
        for (int k = base->start[i]; k < base->start[i + 1]; k++)
            value[k] = base->value[k] + row[base->column[k]];
    }
}

/* out = X v */
static void through(int r, const double *X, const double *v, double *out)
{
    for (int i = 0; i < r; i++) {
        out[i] = 0.0;
        for (int j = 0; j < r; j++)
            out[i] += X[i * r + j] * v[j];
    }
}

void flexura_tuning(const Model *model, const double *x, const double *u, const double *d, const double *X,
                    const double *dd, double *dw, double *work)
{
    const int r = model->ports;
    double *z = work, *w = work + r;
    for (int i = 0; i < r; i++) {
        z[i] = flexura_row(&model->of_states, i, x) + flexura_row(&model->of_inputs, i, u);
        dw[i] = d[i] * z[i];
    }
    through(r, X, dw, w);
    for (int i = 0; i < r; i++)
        z[i] = dd[i] * (z[i] + flexura_row(&model->around, i, w));
    through(r, X, z, dw);
}
