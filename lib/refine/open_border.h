/* The textbook's open border: a new point exists only where all of its parents do, so that an open mesh loses
 * the faces that touch its border. A 4 x 4 grid of points becomes 9 + 12 + 4 = 25. */
#ifndef TWEEND_OPEN_H
#define TWEEND_OPEN_H

#include "topology.h"
#include "tweend/subdiv.h"

/* Lists the child's faces whose parents all exist: those at an inner vertex of the parent and, of Loop's
 * middle triangles, those of a parent face with no edge on the border. near: NULL, or [parent->vertex_count]
 * flags: of these faces those alone at a vertex that is marked and, of middle triangles, of a parent face
 * with such a vertex. *faces: [returned count], in the arena; NULL without memory. */
uint32_t tw_open_faces(const tw_topology *parent, const tw_topology *child, const uint8_t *near,
                       tw_arena *arena, uint32_t **faces);

/* Whether a face is at the border: it has a vertex there. */
bool tw_open_is_rim(const tw_topology *topology, uint32_t face);

/* Makes a topology of some faces of `full`, whose faces all have one size. Sharpness is copied; new borders
 * are sharp. *vertices: [out->vertex_count], the vertex of `full` that each one was. TW_NO_MEMORY. */
tw_status tw_open_cut(const tw_topology *full, const uint32_t *faces, uint32_t face_count, tw_arena *arena,
                      tw_topology *out, uint32_t **vertices);

/* Counts at `level` (1 or more) of the faces that an open border leaves of a cage, in closed form: no level
 * is made. visible: [cage->face_count] the faces whose children are counted; NULL: all. O(cage + level),
 * allocates nothing. */
tw_surface_counts tw_open_count(const tw_topology *cage, const uint8_t *visible, uint32_t level);
/* The same for Loop's scheme. */
tw_surface_counts tw_loop_open_count(const tw_topology *cage, const uint8_t *visible, uint32_t level);

/* Counts of the visible faces of a mesh, and of their vertices and edges; visible as above. */
tw_surface_counts tw_count_faces(const tw_topology *topology, const uint8_t *visible);

#endif
