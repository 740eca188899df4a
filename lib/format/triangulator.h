/* The faces of a surface as triangles. */
#ifndef TWEEND_TRIANGULATOR_H
#define TWEEND_TRIANGULATOR_H

#include "tweend/format.h"

static inline uint64_t tw_least(uint64_t a, uint64_t b) {
  return a < b ? a : b;
}

/* Turns faces to triangles; one stream's own. */
typedef struct tw_triangulator {
  tw_surface_reader *reader; /* the caller's, of all the surfaces */
  tw_polygons polygons;
  size_t corner_capacity;
  uint32_t *corners; /* [corner_capacity] of faces: room for one, the one before and the one after */
  uint32_t *sizes;   /* of the faces in corners */
} tw_triangulator;

/* For any of the surfaces. False without memory; deinit is due all the same. */
bool tw_triangulator_init(tw_triangulator *triangles, const tw_surface *const *surfaces, uint32_t count,
                          tw_polygons polygons, tw_surface_reader *reader);
void tw_triangulator_deinit(tw_triangulator *triangles); /* a zeroed one is fine */

/* All faces of a material from group *i on, which is moved past them. */
tw_surface_group tw_take_material(const tw_surface *surface, uint32_t *i);

/* How many triangles the faces are. */
uint64_t tw_count_triangles(const tw_surface_group *faces);

/* The corner that a face's fan starts from, of TW_POLYGONS_NGON, where it is every second face of its
 * material; the others start from their first. corners: of the face; previous, next: the first corner of its
 * neighbours in the material, or NULL. */
uint32_t tw_fan_start(const uint32_t *corners, const uint32_t *previous, const uint32_t *next);

/* Triangles [first, first + count) of `faces`, which are all of one material, as rows of TW_DOMAIN_VERTICES.
 * Each face is a fan. TW_POLYGONS_NGON: neighbouring faces do not start from the same vertex. Turns the
 * reader. out: [count][3]. */
void tw_triangulator_read(tw_triangulator *triangles, const tw_surface *surface,
                          const tw_surface_group *faces, uint64_t first, size_t count, uint32_t *out);

#endif
