/* Cages with the topology of a torus, of many kinds. */
#ifndef TORUS_CAGE_H
#define TORUS_CAGE_H

#include "built_cage.h"

enum { TORUS_SIDE = 6 }; /* points in both directions */

typedef enum torus_faces {
  TORUS_TRIANGLES,        /* six around each point */
  TORUS_TURNED_TRIANGLES, /* some quads cut along the other diagonal: many valences */
  TORUS_MIXED,            /* triangles and quads */
  TORUS_QUADS             /* four around each point */
} torus_faces;

typedef enum torus_gaps { NO_GAPS, GAPS, GAPS_THAT_TOUCH } torus_gaps;

static inline void add_scattered_points(cage *c, uint32_t count) {
  for (uint32_t p = 0; p < count; p++) {
    float at[3];
    for (uint32_t i = 0; i < 3; i++) at[i] = 0.1f * (float)((p * p * (i + 3) + 7 * p) % 101) - 3;
    add_point(c, at[0], at[1], at[2]);
  }
}

static inline bool torus_lacks(torus_gaps gaps, uint32_t x, uint32_t y) {
  if (gaps == GAPS) return x % 3 == 0 && y % 3 == 0;
  return gaps == GAPS_THAT_TOUCH && (x + y) % 5 == 0;
}

/* gaps: missing faces. fin: a third face at one edge, to the last point. The last two points are in no other
 * face. */
static inline cage *torus(torus_faces faces, torus_gaps gaps, bool fin) {
  cage *c = new_cage();
  add_scattered_points(c, TORUS_SIDE * TORUS_SIDE + 2);
  for (uint32_t y = 0; y < TORUS_SIDE; y++)
    for (uint32_t x = 0; x < TORUS_SIDE; x++) {
      uint32_t right = (x + 1) % TORUS_SIDE, row = y * TORUS_SIDE, above = (y + 1) % TORUS_SIDE * TORUS_SIDE;
      uint32_t a = row + x, b = row + right, d = above + x, e = above + right;
      if (torus_lacks(gaps, x, y)) continue;
      bool third = (x + 2 * y) % 3 == 0;
      if (faces == TORUS_MIXED)
        add_quad(c, (uint32_t[]){e, d, a, b}, third);
      else if (faces == TORUS_QUADS)
        add_quad(c, (uint32_t[]){e, d, a, b}, false);
      else if (faces == TORUS_TURNED_TRIANGLES && third)
        add_quad(c, (uint32_t[]){b, e, d, a}, true);
      else
        add_quad(c, (uint32_t[]){e, d, a, b}, true);
    }
  if (fin) add_face(c, (uint32_t[]){c->corners[0], c->corners[1], c->mesh.point_count - 1}, 3);
  return c;
}

#endif
