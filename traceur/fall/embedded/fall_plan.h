/* Plans a fall on a microcontroller: reads what `traceur fall compile` wrote, straight from flash.
 * C99, no heap, no global state, single precision; the layout of the file is the structs below.
 *
 *   const struct fall_library *library;
 *   const char *wrong = fall_open(bytes, size, &library);      once; NULL: it can be used
 *   enum fall_answer answer = fall_next(library, &state, &contact);
 *
 * when the fall is noticed, and again with the measured state whenever a contact has been made.
 *
 * The plane of the fall: x along it, y up. The robot is a pendulum that turns about the part on the
 * ground: r its length to the centre of mass, theta its angle from the vertical, positive towards
 * the fall. A contact is a stopper at theta2 from the prolonged rod. [Ha2015, chapter 4]
 */
#ifndef FALL_PLAN_H
#define FALL_PLAN_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* NOLINTBEGIN(readability-identifier-naming,modernize-*): C, not C++ */

#define FALL_LIBRARY_VERSION 1u
#define FALL_LIBRARY_MAGIC "FALLPLAN"

/* ---- Layout: little-endian, 4-byte aligned; offsets in bytes from the beginning of the file. ----
 */

struct fall_axis { /* evenly spaced */
  float min, max;
  uint32_t n;
};

struct fall_library { /* at offset 0 */
  char magic[8];
  uint32_t version;
  uint32_t size;       /* of the whole file [bytes] */
  uint32_t checksum;   /* FNV-1a, 32 bits, of everything behind this field */
  uint32_t problem[2]; /* fingerprint of robot, stance and options: low, high word */
  char robot[32], stance[32], direction[12];
  float mass;           /* [kg] */
  float inertia;        /* of the body about its centre of mass [kg m^2] */
  float gravity;        /* [m/s^2] */
  float step;           /* of the integration [s] */
  float rod_speed;      /* largest rate of r [m/s] */
  float stopper_speed;  /* largest rate of theta2 [rad/s] */
  float least_interval; /* from the beginning or a contact to the next contact [s] */
  float grid_time;      /* between possible contacts [s] */
  float grid_angle;     /* between possible theta2 [rad] */
  float horizon;        /* longest time to the next contact [s] */
  uint32_t rod_rates;   /* tried, evenly over +- rod_speed */
  uint32_t stall_stops; /* 1: a pendulum that turns back has stopped */
  uint32_t nodes, first_node;
};

struct fall_library_node { /* nodes of them, from first_node on; the first stands at the beginning
                            */
  char name[24];
  uint32_t edges, first_edge;            /* what may touch next */
  struct fall_axis time, theta, r, rate; /* [s], [rad], [m], [rad/s] */
  uint32_t
      values; /* float[time][theta][r][rate]: the largest impulse still to come at best [N s] */
};

struct fall_library_edge {
  uint32_t to;
  float first_angle;      /* theta2 of the part in the stance [rad] */
  float cell;             /* of r1 and r2 [m] */
  uint32_t cells, angles; /* of the reach table */
  uint32_t reach;         /* bits [r1][r2][theta2], the lowest of a byte first */
};

/* ---- Planning. ---- */

struct fall_state {
  uint32_t node;    /* on the ground */
  float time;       /* since the fall began [s] */
  float theta;      /* [rad] */
  float r;          /* [m] */
  float theta_rate; /* [rad/s] */
};

struct fall_contact {
  uint32_t node;          /* what is to touch */
  float duration;         /* when, from the state on [s] */
  float theta2;           /* where the stopper is then [rad] */
  float rod_rate;         /* of r until then [m/s] */
  float impulse;          /* predicted [N s] */
  float advance;          /* of the next pivot from this one, along x [m] */
  float cost;             /* the largest impulse from here on, by the table [N s] */
  struct fall_state next; /* predicted, after the impact */
};

enum fall_answer {
  FALL_CONTACT, /* make this contact */
  FALL_STOPS,   /* it stops by itself: none is needed */
  FALL_NONE     /* there is no contact that it can reach */
};

static inline uint32_t fall_checksum(const void* bytes, size_t size) {
  const unsigned char* b = (const unsigned char*)bytes;
  uint32_t hash = 2166136261u;
  for (size_t i = 0; i < size; ++i) hash = (hash ^ b[i]) * 16777619u;
  return hash;
}

/* Most contacts and steps that fall_next() may look at: so that a damaged file cannot keep it for
 * ever. [ours; the libraries of BioloidGP and Atlas ask for 102 001 at most] */
#define FALL_MOST_WORK 10000000.0f

static inline const struct fall_library_node* fall_node(const struct fall_library* l, uint32_t i) {
  return (const struct fall_library_node*)((const char*)l + l->first_node) + i;
}

static inline int fall_is_named(const char* name, size_t size) {
  return memchr(name, '\0', size) != NULL;
}

/* Whether `count` things of `each` bytes from `first` on, aligned to 4, lie in the file. */
static inline int fall_holds(const struct fall_library* l, uint64_t first, uint64_t count,
                             uint64_t each) {
  return first % 4 == 0 && first <= l->size && count <= l->size && count * each <= l->size - first;
}

static inline int fall_is_edge(const struct fall_library* l, const struct fall_library_edge* e) {
  static const uint32_t kMost = 65536; /* so that their product does not overflow */
  return e->to < l->nodes && isfinite(e->first_angle) && e->cell > 0 && isfinite(e->cell) &&
         e->cells >= 1 && e->cells <= kMost && e->angles >= 1 && e->angles <= kMost &&
         fall_holds(l, e->reach, ((uint64_t)e->cells * e->cells * e->angles + 7) / 8, 1);
}

static inline int fall_is_node(const struct fall_library* l, const struct fall_library_node* n) {
  const struct fall_axis* axes[4] = {&n->time, &n->theta, &n->r, &n->rate};
  uint64_t values = 1;
  if (!fall_is_named(n->name, sizeof n->name) || !(n->r.min > 0)) return 0;
  for (int i = 0; i < 4; ++i) {
    if (!(axes[i]->min < axes[i]->max) || !isfinite(axes[i]->max - axes[i]->min) ||
        axes[i]->n < 2 || axes[i]->n > l->size) {
      return 0;
    }
    values *= axes[i]->n;
    if (values > l->size) return 0;
  }
  if (!fall_holds(l, n->values, values, sizeof(float)) ||
      !fall_holds(l, n->first_edge, n->edges, sizeof(struct fall_library_edge))) {
    return 0;
  }
  const float* value = (const float*)((const char*)l + n->values);
  for (uint64_t i = 0; i < values; ++i) {
    if (!(value[i] >= 0) || !isfinite(value[i])) return 0;
  }
  const struct fall_library_edge* edge =
      (const struct fall_library_edge*)((const char*)l + n->first_edge);
  for (uint32_t i = 0; i < n->edges; ++i) {
    if (!fall_is_edge(l, &edge[i])) return 0;
  }
  /* what fall_next() walks through */
  const float steps = l->horizon / l->step, contacts = l->horizon / l->grid_time + 1;
  const float angles = 7 / l->grid_angle + 1;
  return (float)l->rod_rates * (steps + contacts * (float)n->edges * angles) <= FALL_MOST_WORK;
}

/* Whether planning from any state ends and reads nothing but the file. */
static inline int fall_is_sound(const struct fall_library* l) {
  const float positive[] = {l->mass,      l->inertia,    l->gravity, l->step,
                            l->grid_time, l->grid_angle, l->horizon};
  const float least_0[] = {l->rod_speed, l->stopper_speed, l->least_interval};
  for (size_t i = 0; i < sizeof positive / sizeof *positive; ++i) {
    if (!(positive[i] > 0) || !isfinite(positive[i])) return 0;
  }
  for (size_t i = 0; i < sizeof least_0 / sizeof *least_0; ++i) {
    if (!(least_0[i] >= 0) || !isfinite(least_0[i])) return 0;
  }
  if (!fall_is_named(l->robot, sizeof l->robot) || !fall_is_named(l->stance, sizeof l->stance) ||
      !fall_is_named(l->direction, sizeof l->direction) || l->rod_rates < 1 ||
      !(l->grid_time >= l->step) || !(l->grid_time <= l->horizon) || !(l->grid_angle >= 1e-4f) ||
      l->nodes < 1 || !fall_holds(l, l->first_node, l->nodes, sizeof(struct fall_library_node))) {
    return 0;
  }
  for (uint32_t i = 0; i < l->nodes; ++i) {
    if (!fall_is_node(l, fall_node(l, i))) return 0;
  }
  return 1;
}

/* What is wrong with the bytes, which must stay where they are, aligned to 4; NULL if nothing. */
static inline const char* fall_open(const void* bytes, size_t size,
                                    const struct fall_library** library) {
  const struct fall_library* l = (const struct fall_library*)bytes;
  const size_t summed = offsetof(struct fall_library, problem);
  *library = NULL;
  if (size < sizeof *l || memcmp(l->magic, FALL_LIBRARY_MAGIC, sizeof l->magic) != 0) {
    return "not a library of fall plans";
  }
  if (l->version != FALL_LIBRARY_VERSION) return "a library of fall plans of another version";
  if (l->size != size) return "a library of fall plans of another size than it says";
  if (l->checksum != fall_checksum((const char*)bytes + summed, size - summed)) {
    return "a library of fall plans whose checksum is wrong";
  }
  if (!fall_is_sound(l)) return "a library of fall plans that contradicts itself";
  *library = l;
  return NULL;
}

/* The largest impulse still to come from a state at best, interpolated; at the table's edge outside
 * it. */
static inline float fall_value(const struct fall_library* l, const struct fall_state* s) {
  const struct fall_library_node* node = fall_node(l, s->node);
  const float* values = (const float*)((const char*)l + node->values);
  const struct fall_axis* axes[4] = {&node->time, &node->theta, &node->r, &node->rate};
  const float where[4] = {s->time, s->theta, s->r, s->theta_rate};
  float part[4];
  size_t stride[4], first = 0, product = 1;
  float value = 0;
  for (int i = 3; i >= 0; --i) {
    float u = (where[i] - axes[i]->min) / (axes[i]->max - axes[i]->min);
    u = (u > 0 ? u < 1 ? u : 1 : 0) * (float)(axes[i]->n - 1); /* no number: 0 */
    uint32_t low = (uint32_t)u;
    if (low > axes[i]->n - 2) low = axes[i]->n - 2;
    part[i] = u - (float)low;
    stride[i] = product;
    first += low * product;
    product *= axes[i]->n;
  }
  for (int corner = 0; corner < 16; ++corner) {
    float weight = 1;
    size_t at = first;
    for (int i = 0; i < 4; ++i) {
      const int upper = corner >> i & 1;
      weight *= upper ? part[i] : 1 - part[i];
      at += upper ? stride[i] : 0;
    }
    if (weight > 0) value += weight * values[at];
  }
  return value;
}

/* Whether an impact ended the fall. */
static inline int fall_stopped(const struct fall_library* l, const struct fall_state* s) {
  if (s->theta_rate <= 0) return 1;
  if (!l->stall_stops || s->theta >= 0) return 0;
  return s->r * s->theta_rate * s->theta_rate < 2 * l->gravity * (1 - cosf(s->theta));
}

static inline int fall_reachable(const struct fall_library* l, const struct fall_library_edge* e,
                                 float r1, float r2, float theta2) {
  static const float kTurn = 6.28318531f;
  const float i1 = r1 / e->cell, i2 = r2 / e->cell;
  if (!(i1 >= 0 && i1 < (float)e->cells && i2 >= 0 && i2 < (float)e->cells)) return 0;
  const float turn = theta2 / kTurn;
  uint32_t angle = (uint32_t)((turn - floorf(turn)) * (float)e->angles);
  if (angle > e->angles - 1) angle = e->angles - 1;
  const size_t bit = ((size_t)(uint32_t)i1 * e->cells + (uint32_t)i2) * e->angles + angle;
  return ((const unsigned char*)l + e->reach)[bit / 8] >> (bit % 8) & 1;
}

/* The contact that is best to make next; FALL_NONE also for a node that there is not and for a
 * state that is not finite. What is written to best is of meaning only if the answer is
 * FALL_CONTACT. A fall that nothing stops has contacts too, of a large cost. Whether keeping the
 * pose would cost less is not asked here. */
static inline enum fall_answer fall_next(const struct fall_library* l,
                                         const struct fall_state* from, struct fall_contact* best) {
  static const float kPi = 3.14159265f;
  best->cost = INFINITY;
  if (from->node >= l->nodes || !isfinite(from->time) || !isfinite(from->theta) ||
      !isfinite(from->r) || !isfinite(from->theta_rate)) {
    return FALL_NONE;
  }
  const struct fall_library_node* node = fall_node(l, from->node);
  const struct fall_library_edge* edges =
      (const struct fall_library_edge*)((const char*)l + node->first_edge);
  const int stride = (int)lroundf(l->grid_time / l->step);
  const int last = (int)lroundf(l->horizon / l->step);
  const int angles = (int)lroundf(2 * kPi / l->grid_angle);
  if (fall_stopped(l, from)) return FALL_STOPS;
  for (uint32_t i = 0; i < l->rod_rates; ++i) {
    const float rod_rate =
        l->rod_rates == 1 ? 0 : l->rod_speed * (2 * (float)i / (float)(l->rod_rates - 1) - 1);
    float theta = from->theta, r = from->r, rate = from->theta_rate;
    for (int k = 1; k <= last && theta < kPi / 2; ++k) {
      rate += l->step * (l->gravity * sinf(theta) - 2 * rod_rate * rate) / r;
      theta += l->step * rate;
      r += l->step * rod_rate;
      /* no longer and no shorter than the robot can make it, give or take a twentieth */
      if (r > 1.05f * node->r.max || r < node->r.min / 1.05f) break;
      if (rate <= 0) {
        if (l->stall_stops) return FALL_STOPS;
        break;
      }
      const float duration = (float)k * l->step;
      if (k % stride != 0 || duration < l->least_interval - 1e-6f) continue;
      const float time = from->time + duration;
      const float c = cosf(theta), s = sinf(theta), x1 = r * s, y1 = r * c;
      const float vx = rod_rate * s + r * rate * c, vy = rod_rate * c - r * rate * s;
      for (uint32_t e = 0; e < node->edges; ++e) {
        for (int a = 1; a <= angles; ++a) {
          const float theta2 = -kPi + (float)a * l->grid_angle;
          const float turn = fabsf(remainderf(theta2 - edges[e].first_angle, 2 * kPi));
          const float down = cosf(theta + theta2);
          if (turn > time * l->stopper_speed || down >= 0) continue;
          const float r2 = -y1 / down;
          if (!(r2 > 0 && r2 < 100 * r) || !fall_reachable(l, &edges[e], r, r2, theta2)) continue;
          const float d = r2 * sinf(theta + theta2); /* of the tip from the centre of mass */
          const float tip = vy - d * rate;
          if (tip >= 0) continue;
          const float impulse = -tip / (1 / l->mass + d * d / l->inertia);
          if (impulse >= best->cost) continue;
          const float up = vy + impulse / l->mass;
          const struct fall_state next = {edges[e].to, time, atan2f(-d, y1), r2,
                                          (y1 * vx + d * up) / (r2 * r2)};
          const float rest = fall_stopped(l, &next) ? 0 : fall_value(l, &next);
          const float cost = impulse > rest ? impulse : rest;
          if (cost >= best->cost) continue;
          const struct fall_contact better = {edges[e].to, duration, theta2, rod_rate,
                                              impulse,     x1 + d,   cost,   next};
          *best = better;
        }
      }
    }
  }
  return best->cost < INFINITY ? FALL_CONTACT : FALL_NONE;
}

/* NOLINTEND(readability-identifier-naming,modernize-*) */

#endif
