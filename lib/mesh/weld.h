/* Welds the vertices of a vertex buffer into the points of a surface. Renderers need a vertex for each
 * different normal or texture coordinate, so files split points along seams; the surface must not tear
 * there. */
#ifndef TWEEND_WELD_H
#define TWEEND_WELD_H

#include "soup.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The result of welding. */
typedef struct tw_welded {
  uint32_t point_count;
  /* Faces left out: collapsed ones have fewer than three different places; doubled ones are listed before, in
   * the same direction and with the same material; slivers lie between the two sides of a seam, flatter than
   * 2^-20 of the soup's extent. */
  uint32_t collapsed, doubled, slivers;
  uint32_t reversed_edges; /* pairs of edges along the same positions that run the same way: their faces are
                              wound against each other, and they are not joined */
  uint32_t open_edges;     /* edges that are not joined as more than two run along the same positions */
} tw_welded;

/* Behind the count of collapsed faces, whatever made them so. */
#define TW_COLLAPSED_FACE  "face with fewer than three different points is left out"
#define TW_COLLAPSED_FACES "faces with fewer than three different points are left out"

/* Finds which vertices are one point. Two edges between the same two positions that run in opposite
 * directions are one edge, and their ends one point each, unless a third edge runs there. So seams close, and
 * surfaces that only touch stay apart, as do parts that move differently (soup->compare). Coordinates below a
 * millionth of the largest, or of the soup's extent where that is less, count as 0. Faces that keep seams
 * from closing are left out first.
 * point_of_vertex: [vertex_count]; points are numbered in the order of their first vertex, also that of a
 * face left out. left_out: [face_count] receives 1 for each face that the caller has to drop, else 0. Corners
 * that follow each other in a face may become one point. O(n log n) at worst. TW_NO_MEMORY. */
tw_status tw_weld_points(const tw_soup *soup, uint32_t *point_of_vertex, uint8_t *left_out, tw_welded *out,
                         tw_error *error);

/* Whether several vertices are at one place, which tw_weld_points may make one point: soup->compare does not
 * count. O(n log n) at worst. TW_NO_MEMORY. */
tw_status tw_share_places(const tw_soup *soup, bool *out);

/* Finds which vertices share a value, such as a texture coordinate or a colour: vertices of one point that
 * are joined by an edge with equal values on both sides. Parts of a texture that only touch stay apart.
 * point_of_vertex: from tw_weld_points, or any other numbers below point_count. rows: [vertex_count][width].
 * value_of_vertex: [vertex_count], numbered as points are. TW_INVALID: a point is out of range.
 * TW_NO_MEMORY. */
tw_status tw_weld_values(const tw_soup *soup, const uint32_t *point_of_vertex, uint32_t point_count,
                         const float *rows, uint32_t width, uint32_t *value_of_vertex, uint32_t *value_count,
                         tw_error *error);

/* Whether vertices of one point have different values. rows: [vertex_count][width]; first_vertices: the first
 * vertex of each point. */
bool tw_values_part(const uint32_t *point_of_vertex, uint32_t vertex_count, const uint32_t *first_vertices,
                    const float *rows, uint32_t width);

/* The least distance but 0 of tw_weld_within: coordinates up to TW_COORDINATE_MAX are finite multiples of it.
 */
#define TW_WELD_LEAST 1e-280

/* Finds which points are one: those within a distance of the first of them; 0: those at the same place. Other
 * distances are at least TW_WELD_LEAST. positions: [count][3]; point_of: [count], numbered in the order of
 * each new point's first old point. O(n log n). TW_NO_MEMORY. */
tw_status tw_weld_within(const float *positions, uint32_t count, double distance, uint32_t *point_of,
                         uint32_t *point_count, tw_error *error);

/* Less than, equal to or greater than 0 as the first numbers that differ; finite. */
int tw_compare_floats(const float *a, const float *b, size_t count);

/* Finds equal rows of floats; 0 and -0 are equal. rows: [count][width]; first: [count] receives for each row
 * the first row equal to it. O(n log n) at worst. TW_NO_MEMORY. */
tw_status tw_find_equal_rows(const float *rows, uint32_t width, uint32_t count, uint32_t *first,
                             tw_error *error);

/* The most bytes that any function here allocates while it runs. */
size_t tw_weld_size(uint32_t vertex_count, uint32_t corner_count);

#ifdef __cplusplus
}
#endif
#endif
