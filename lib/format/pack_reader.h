/* Computes the bytes of packs: quantized, and compressed by meshoptimizer. */
#ifndef TWEEND_PACK_READER_H
#define TWEEND_PACK_READER_H

#include "pack_layout.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reorders triangles so that they compress well. indices: [count], below vertex_count. False without
 * memory. */
bool tw_order_triangles(uint32_t *indices, size_t count, uint32_t vertex_count);

/* Computes the bytes of parts; belongs to one stream. */
typedef struct tw_pack_reader tw_pack_reader;

/* For any of the packs of a scene and their surfaces. NULL without memory. */
tw_pack_reader *tw_pack_reader_create(const tw_packs *const *packs, const tw_surface *const *surfaces,
                                      uint32_t count);
void tw_pack_reader_destroy(tw_pack_reader *reader); /* NULL accepted */

/* The bytes of a part as they are sent, [tw_packs_part_size], valid until the next call. Calls for parts of
 * the same pack in turn are cheap. surface: the surface of the packs. NULL without memory. */
const uint8_t *tw_pack_read(tw_pack_reader *reader, const tw_packs *packs, const tw_surface *surface,
                            uint32_t pack, uint32_t part);

/* Reads the part as tw_pack_read, which then returns at once; false without memory. */
bool tw_pack_reader_turn(tw_pack_reader *reader, const tw_packs *packs, const tw_surface *surface,
                         uint32_t pack, uint32_t part);

/* The part that was read last: before it is compressed, and its size after that. */
const uint8_t *tw_pack_reader_bytes(const tw_pack_reader *reader);
size_t tw_pack_reader_encoded_size(const tw_pack_reader *reader);

#ifdef __cplusplus
}
#endif
#endif
