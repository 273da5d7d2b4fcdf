/* All elements of a model in motion, one kind after another, as MovingModel.kinetics of motion/model.py. */
#include "ldl.h"

/* Elements (e) between k frames each, beams and springs or superelements. */
typedef struct {
    int64_t is_super, e, k;
    const int64_t *node;
    const void *own;
} group;

/* All `groups` (count), and the frames `at` (bodies) that carry mass, `inertia` as bodies_kinetics takes it; `memory` is
what the kind of elements needs that needs most. `dof` (frames, 6) numbers the n free displacements, below zero where
there is none, of which the frames `free` (free_frames) have some; those move and turn that are `placed`. `weight` (frames,
6, 3) are forces in the axes of frames by acceleration of free fall, `inside` (sags, 6, 3) those on amplitudes, which hang
on frames `hangs` (sags, 2) with the first one's axes. Nodes are on frames `root` at `arm` (nodes, 3). */
typedef struct {
    int64_t count, bodies, memory, frames, n, free_frames, sags;
    const group *groups;
    const int64_t *at;
    const double *inertia;
    const int64_t *dof, *free;
    const uint8_t *placed;
    const double *weight;
    const int64_t *hangs;
    const double *inside;
    const int64_t *root;
    const double *arm;
} model;

int64_t superelements_kinetics(const void *own, const double *x, const double *R, const double *z,
                               const double *velocity, const double *acceleration, double damping, double *scratch,
                               double *force, double *energies);
int64_t pose_elements_kinetics(const void *own, const double *x, const double *R, const double *velocity,
                               const double *acceleration, double damping, double *scratch, double *force,
                               double *energies);
int64_t bodies_kinetics(int64_t e, const int64_t *at, const double *inertia, const double *R, const double *velocity,
                        const double *acceleration, double *force, double *energy);

int64_t frames_moved(int64_t n, const int64_t *at, const uint8_t *placed, const double *step, double *x, double *R,
                     double *z);

/* Forces on the frames, added to `total` (frames, 6), that hold, damp and accelerate all of a model (theory eqs. G33-G34).
`scratch` begins with two numbers for its strain energy and kinetic energy; then comes what elements need, and as much
as all forces on those of one kind. */
KERNEL int64_t motion_kinetics(const model *own, const double *x, const double *R, const double *z,
                               const double *velocity, const double *acceleration, double damping, double *scratch,
                               double *total)
{
    double *energies = scratch, more[2], *memory = scratch + 2, *force = memory + own->memory;
    energies[0] = 0;
    bodies_kinetics(own->bodies, own->at, own->inertia, R, velocity, acceleration, total, energies + 1);
    for (int64_t g = 0; g < own->count; g++) {
        const group *kind = own->groups + g;
        if (kind->is_super)
            superelements_kinetics(kind->own, x, R, z, velocity, acceleration, damping, memory, force, more);
        else
            pose_elements_kinetics(kind->own, x, R, velocity, acceleration, damping, memory, force, more);
        energies[0] += more[0], energies[1] += more[1];
        for (int64_t i = 0; i < kind->e * kind->k; i++)
            for (int j = 0; j < 6; j++) total[6 * kind->node[i] + j] += force[6 * i + j];
    }
    return 0;
}

/* The frames with free displacements, x_moved, R_moved, z_moved, after D (n) from x, R, z. */
KERNEL int64_t motion_moved(const model *own, const double *x, const double *R, const double *z, const double *D,
                            double *x_moved, double *R_moved, double *z_moved)
{
    double step[4 * 6];
    for (int64_t k = 0; k < own->free_frames; k += 4) {
        int64_t count = own->free_frames - k < 4 ? own->free_frames - k : 4;
        for (int64_t l = 0; l < count; l++) {
            int64_t frame = own->free[k + l];
            for (int j = 0; j < 6; j++) {
                int64_t at = own->dof[6 * frame + j];
                step[6 * l + j] = at < 0 ? 0 : D[at];
            }
            memcpy(x_moved + 3 * frame, x + 3 * frame, 3 * sizeof *x);
            memcpy(R_moved + 9 * frame, R + 9 * frame, 9 * sizeof *R);
            memcpy(z_moved + 6 * frame, z + 6 * frame, 6 * sizeof *z);
        }
        frames_moved(count, own->free + k, own->placed, step, x_moved, R_moved, z_moved);
    }
    return 0;
}

static inline void add_turned(double *out, double sign, const double *R, const double *v)
{
    for (int i = 0; i < 3; i++) out[i] += sign * (R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2]);
}

static inline void add_cross(double *out, double sign, const double *a, const double *b)
{
    out[0] += sign * (a[1] * b[2] - a[2] * b[1]);
    out[1] += sign * (a[2] * b[0] - a[0] * b[2]);
    out[2] += sign * (a[0] * b[1] - a[1] * b[0]);
}

/* Takes loads off the forces that hold frames: wrenches (dead + follower, 6) on nodes, as Loads.forces of motion/model.py. */
static inline void take_loads(double *total, const model *own, int64_t dead, int64_t follower, const int64_t *nodes,
                              const double *wrenches, const double *R)
{
    for (int64_t k = 0; k < dead + follower; k++, wrenches += 6) {
        int64_t frame = own->root[nodes[k]];
        double arm[3] = {0}, wrench[6] = {0};
        add_turned(arm, 1, R + 9 * frame, own->arm + 3 * nodes[k]);
        if (k < dead) memcpy(wrench, wrenches, sizeof wrench);
        else
            for (int i = 0; i < 6; i += 3) add_turned(wrench + i, 1, R + 9 * frame, wrenches + i);
        add_cross(wrench + 3, 1, arm, wrench);
        for (int i = 0; i < 6; i++) total[6 * frame + i] -= wrench[i];
    }
}

/* Takes weight off them, as MovingModel and Sagging do. */
static inline void take_weight(double *total, const model *own, const double *gravity, const double *R, const double *z)
{
    for (int64_t k = 0; k < own->free_frames + own->sags; k++) {
        int64_t hangs = k - own->free_frames, first = hangs < 0 ? own->free[k] : own->hangs[2 * hangs];
        const double *turn = R + 9 * first, *weight = hangs < 0 ? own->weight + 18 * first : own->inside + 18 * hangs;
        double fall[3], force[6] = {0}, centre[3] = {0}, global[3] = {0};
        for (int j = 0; j < 3; j++) fall[j] = turn[j] * gravity[0] + turn[3 + j] * gravity[1] + turn[6 + j] * gravity[2];
        add_turned(force, 1, weight, fall);
        add_turned(force + 3, 1, weight + 9, fall);
        if (hangs < 0) {
            add_turned(total + 6 * first, -1, turn, force);
            add_turned(total + 6 * first + 3, -1, turn, force + 3);
            continue;
        }
        int64_t amplitudes = own->hangs[2 * hangs + 1];
        for (int i = 0; i < 6; i++) {
            total[6 * amplitudes + i] -= force[i];
            for (int j = 0; j < 3; j++) centre[j] += z[6 * amplitudes + i] * weight[3 * i + j];
        }
        add_turned(global, 1, turn, centre);
        add_cross(total + 6 * first + 3, -1, global, gravity);
    }
}

/* What steps of generalised-alpha take: the model, the `scale` (n) of displacements, and the factors of their matrix, whose
rows and columns are times `by` (n), L D L' or LAPACK's LU by columns with pivots. `numbers` are alpha, 1/s, and beta, s,
of the damping, what makes local errors of changes of accelerations, h, s, four derivatives by displacements of a step, and
what (4, 4) leads on, as Scheme of motion/newton.py. `memory` begins with six numbers and the correction (n), zero all over
before. */
typedef struct {
    const model *own;
    const double *scale, *numbers;
    double *memory;
    int64_t is_dense;
    const int64_t *order, *first, *below;
    const double *L, *D, *by;
} desk;

/* x (n) = A^-1 x by LU, of which row i was exchanged with row pivots[i]. */
static inline void lu_solution(int64_t n, const int64_t *pivots, const double *LU, double *x)
{
    for (int64_t i = 0; i < n; i++) {
        double own = x[pivots[i]];
        x[pivots[i]] = x[i], x[i] = own;
    }
    for (int64_t k = 0; k < n; k++)
        for (int64_t i = k + 1; i < n; i++) x[i] -= LU[n * k + i] * x[k];
    for (int64_t k = n; k-- > 0;) {
        x[k] /= LU[n * k + k];
        for (int64_t i = 0; i < k; i++) x[i] -= LU[n * k + i] * x[k];
    }
}

static inline void take_larger(double *most, double value)
{
    if (fabs(value) > *most || value != value) *most = fabs(value);
}

/* The `motion` (5, n) at the end of a step from frames x, R, z with motion `before`, displacements, velocities,
accelerations, auxiliary ones and how accelerations change, to where accelerations lead, or the last step where
these are not smooth; both, displacements, into `led` (2, n), and frames there into x_moved, R_moved, z_moved. */
KERNEL int64_t motion_begin(const desk *at, const double *x, const double *R, const double *z, const double *before,
                            double *x_moved, double *R_moved, double *z_moved, double *motion, double *led,
                            int64_t is_smooth)
{
    int64_t n = at->own->n;
    const double *by_step = at->numbers + 4, *leads = by_step + 4;
    for (int64_t i = 0; i < n; i++) {
        for (int j = 0; j < 4; j++) {
            motion[n * j + i] = 0;
            for (int k = 0; k < 4; k++) motion[n * j + i] += leads[4 * j + k] * before[n * (k + 1) + i];
        }
        led[i] = motion[i], led[n + i] = before[i];
        for (int j = 0; j < 4 && !is_smooth; j++) motion[n * j + i] += by_step[j] * (led[n + i] - led[i]);
    }
    return motion_moved(at->own, x, R, z, motion, x_moved, R_moved, z_moved);
}

/* A look at a step: what moves is corrected by what it lacks of equilibrium under loads and gravity (3), frames along with
it. At the beginning of the memory, the largest of the correction, of its local error, of accelerations times the squared
step, of displacements, and of what these are from where accelerations and the last step led, all over `scale`. */
KERNEL int64_t motion_look(const desk *at, const double *x, const double *R, const double *z, const double *before,
                           double *x_moved, double *R_moved, double *z_moved, double *motion, const double *led,
                           int64_t dead, int64_t follower, const int64_t *nodes, const double *wrenches,
                           const double *gravity)
{
    const model *own = at->own;
    const double *numbers = at->numbers, *by_step = numbers + 4, off = numbers[2], h = numbers[3];
    int64_t n = own->n, size = 6 * own->frames;
    double *largest = at->memory, *correction = largest + 6, *missing = correction + n, *y = missing + n;
    double *velocity = y + n, *growth = velocity + size, *total = growth + size;
    memset(total, 0, size * sizeof *total);
    for (int64_t k = 0; k < own->free_frames; k++)
        for (int64_t i = 6 * own->free[k]; i < 6 * own->free[k] + 6; i++) {
            int64_t dof = own->dof[i];
            if (dof >= 0) velocity[i] = motion[n + dof], growth[i] = motion[2 * n + dof] + numbers[0] * velocity[i];
        }
    motion_kinetics(own, x_moved, R_moved, z_moved, velocity, growth, numbers[1], total + size, total);
    take_loads(total, own, dead, follower, nodes, wrenches, R_moved);
    if (gravity[0] != 0 || gravity[1] != 0 || gravity[2] != 0) take_weight(total, own, gravity, R_moved, z_moved);
    for (int64_t k = 0; k < own->free_frames; k++)
        for (int64_t i = 6 * own->free[k]; i < 6 * own->free[k] + 6; i++)
            if (own->dof[i] >= 0) missing[own->dof[i]] = -total[i] * at->by[own->dof[i]];
    if (at->is_dense) {
        memcpy(correction, missing, n * sizeof *missing);
        lu_solution(n, at->order, at->L, correction);
    } else
        ldl_solution(n, 1, at->order, at->first, at->below, at->L, at->D, missing, correction, y);
    memset(largest, 0, 6 * sizeof *largest);
    for (int64_t i = 0; i < n; i++) {
        correction[i] *= at->by[i];
        for (int j = 0; j < 4; j++) motion[j * n + i] += by_step[j] * correction[i];
        double now = motion[2 * n + i], change = now - before[2 * n + i], scale = at->scale[i];
        motion[4 * n + i] = change / h;
        take_larger(largest, correction[i] * scale);
        take_larger(largest + 1, off * change * scale);
        take_larger(largest + 2, h * h * now * scale);
        take_larger(largest + 3, motion[i] * scale);
        take_larger(largest + 4, (motion[i] - led[i]) * scale);
        take_larger(largest + 5, (motion[i] - led[n + i]) * scale);
    }
    return motion_moved(own, x, R, z, motion, x_moved, R_moved, z_moved);
}
