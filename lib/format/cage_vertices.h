/* The vertices of a cage as files have them, and what a reader that knows no tags makes of these. */
#ifndef TWEEND_CAGE_VERTICES_H
#define TWEEND_CAGE_VERTICES_H

#include "soup.h"
#include "tweend/format.h"

/* The vertices of a surface of level 0. Owns what it points to but the surface and the mesh; a zeroed one may
 * be deinited. */
typedef struct tw_cage_vertices {
  const tw_surface *surface;
  const tw_mesh *mesh;
  tw_surface_reader *reader;
  uint32_t count;
  uint32_t *corner;            /* [count] a corner of the mesh at each vertex */
  uint32_t *point;             /* [count] the mesh's point of each vertex */
  uint32_t *offsets, *corners; /* of the faces, whole at first */
  uint32_t face_count, corner_count;
  int32_t *materials; /* [face_count] of the faces, or NULL */
  float *rows;        /* [2][stride] scratch */
  uint32_t *first;    /* [point_count of the mesh] the first vertex of each point; UINT32_MAX: it has none */
  bool *is_split;     /* [point_count of the mesh] whether it has several */
} tw_cage_vertices;

/* surface: a level 0 of the mesh, whose faces and corners of values it was made from. Both outlive *out,
 * which is to be deinited on failure too. TW_NO_MEMORY. */
tw_status tw_cage_vertices_init(tw_cage_vertices *out, const tw_surface *surface, const tw_mesh *mesh);
void tw_cage_vertices_deinit(tw_cage_vertices *vertices);

/* Finds what a reader makes of a channel where it finds the mesh's points, and adds it to *changes. channel:
 * index of tw_mesh_channels. number: [count] receives the number of each vertex's value, of the values as the
 * mesh tells them apart, in the order of their first vertices. TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_cage_vertices_number(const tw_cage_vertices *vertices, uint32_t channel, uint32_t *number,
                                  tw_cage_changes *changes);

#endif
