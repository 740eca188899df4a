/* Cuts the faces of a surface into triangles. */
#ifndef TWEEND_TRIANGULATOR_H
#define TWEEND_TRIANGULATOR_H

#include "tweend/format.h"

static inline uint64_t tw_least(uint64_t a, uint64_t b) {
  return a < b ? a : b;
}

/* Cuts faces into triangles; belongs to one stream. */
typedef struct tw_triangulator {
  tw_surface_reader *reader; /* the caller's, of all the surfaces */
  tw_polygons polygons;
  tw_domain domain; /* of the rows, TW_DOMAIN_VERTICES unless the caller sets another one */
  size_t corner_capacity;
  uint32_t *corners; /* [corner_capacity] of the faces read; any face fits with its two neighbours */
  uint32_t *sizes;   /* of the faces in corners */
  tw_face_cut *cuts; /* of the faces in corners that have one */
  size_t cut_count;
} tw_triangulator;

/* For any of the surfaces. False without memory; then too it must be deinited. */
bool tw_triangulator_init(tw_triangulator *triangles, const tw_surface *const *surfaces, uint32_t count,
                          tw_polygons polygons, tw_surface_reader *reader);
void tw_triangulator_deinit(tw_triangulator *triangles); /* a zeroed one is fine */

/* Joins the groups of one material from group *i on, and moves *i past them. */
tw_surface_group tw_take_material(const tw_surface *surface, uint32_t *i);

/* Triangles that the faces before this one make: a face makes 2 fewer than it has corners. */
uint64_t tw_triangles_before(const tw_surface *surface, uint64_t face);
/* The face that makes a triangle, counted over the whole surface. O(log faces). */
uint64_t tw_face_of_triangle(const tw_surface *surface, uint64_t triangle);

/* How many triangles the faces make. */
uint64_t tw_count_triangles(const tw_surface_group *faces);

/* For TW_POLYGONS_NGON: the corner that the fan of every second face of a material starts from; the other
 * faces start from the first corner from which their fan is right. corners: [size] of the face, 3 or more;
 * cut: the face's, or NULL; previous, next: the vertices that its neighbours in the material start from, or
 * NULL. False where the fan is wrong, as the right ones start from neighbours' vertices or there is none. */
bool tw_fan_start(const uint32_t *corners, uint32_t size, const tw_face_cut *cut, const uint32_t *previous,
                  const uint32_t *next, uint32_t *start);

/* Triangles [first, first + count) of `faces`, which are all of one material, as rows of the domain.
 * Each face is a fan, or cut as its tw_face_cut says. TW_POLYGONS_NGON: neighbouring faces do not start from
 * the same vertex, and triangles of a face that is no fan are polygons of their own. Turns the reader to
 * `surface`. out: [count][3]. */
void tw_triangulator_read(tw_triangulator *triangles, const tw_surface *surface,
                          const tw_surface_group *faces, uint64_t first, size_t count, uint32_t *out);

#endif
