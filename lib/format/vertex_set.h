/* The rows of a surface that a pack of triangles uses, each once. */
#ifndef TWEEND_VERTEX_SET_H
#define TWEEND_VERTEX_SET_H

#include "tweend/anim.h"
#include "tweend/base.h"

enum {
  TW_PACK_VERTICES_MAX = 65534, /* index 65535 is reserved for primitive restart */
  TW_VERTEX_SLOT_BITS = 17
};

typedef struct tw_vertex_set {
  uint32_t count;
  uint32_t *rows;  /* [TW_PACK_VERTICES_MAX] */
  uint32_t *slots; /* [1 << TW_VERTEX_SLOT_BITS] hash table: place + 1, or 0 */
  uint32_t multiplier;
} tw_vertex_set;

/* False without memory; deinit all the same. */
bool tw_vertex_set_init(tw_vertex_set *set);
void tw_vertex_set_deinit(tw_vertex_set *set);

/* Empties it. */
void tw_vertex_set_clear(tw_vertex_set *set);

/* The places of three rows, new ones where they have none yet. False: the pack is full. */
bool tw_vertex_set_add_triangle(tw_vertex_set *set, const uint32_t rows[3], uint32_t places[3]);

#endif
