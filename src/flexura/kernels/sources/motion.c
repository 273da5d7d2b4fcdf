/* All elements of a model in motion, one kind after another, as MovingModel.kinetics of motion/model.py. */
#include "flexura.h"

/* Elements (e) between k frames each, beams and springs or superelements. */
typedef struct {
    int64_t is_super, e, k;
    const int64_t *node;
    const void *own;
} group;

/* All `groups` (count), and the frames `at` (bodies) that carry mass, `inertia` as bodies_kinetics takes it; `memory` is
what the kind of elements needs that needs most. `dof` (frames, 6) numbers the n free displacements, below zero where
there is none; those frames move that are `placed`. */
typedef struct {
    int64_t count, bodies, memory, frames, n;
    const group *groups;
    const int64_t *at;
    const double *inertia;
    const int64_t *dof;
    const uint8_t *placed;
} model;

int64_t superelements_kinetics(const void *own, const double *x, const double *R, const double *z,
                               const double *velocity, const double *acceleration, double damping, double *scratch,
                               double *force, double *energies);
int64_t pose_elements_kinetics(const void *own, const double *x, const double *R, const double *velocity,
                               const double *acceleration, double damping, double *scratch, double *force,
                               double *energies);
int64_t bodies_kinetics(int64_t e, const int64_t *at, const double *inertia, const double *R, const double *velocity,
                        const double *acceleration, double *force, double *energy);

int64_t frames_moved(int64_t n, const uint8_t *placed, const double *step, const double *x, const double *R,
                     const double *z, double *x_moved, double *R_moved, double *z_moved);

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

/* The frames x_moved, R_moved, z_moved after free displacements from others, and the forces of motion_kinetics there, at
velocities and accelerations of the free displacements: `moving` has them one after another (3, n). Accelerations are
more by `alpha` times velocities. `rates` (3, frames, 6) has all of frames. */
KERNEL int64_t motion_step(const model *own, const double *x, const double *R, const double *z, const double *moving,
                           double alpha, double damping, double *scratch, double *x_moved, double *R_moved,
                           double *z_moved, double *rates, double *total)
{
    int64_t n = own->n, size = 6 * own->frames;
    double *velocity = rates + size, *acceleration = velocity + size;
    for (int64_t i = 0; i < size; i++) {
        int64_t at = own->dof[i];
        double speed = at < 0 ? 0 : moving[n + at];
        rates[i] = at < 0 ? 0 : moving[at];
        velocity[i] = speed, acceleration[i] = at < 0 ? 0 : moving[2 * n + at] + alpha * speed;
        total[i] = 0;
    }
    frames_moved(own->frames, own->placed, rates, x, R, z, x_moved, R_moved, z_moved);
    return motion_kinetics(own, x_moved, R_moved, z_moved, velocity, acceleration, damping, scratch, total);
}
