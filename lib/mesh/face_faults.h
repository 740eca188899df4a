/* Faces that keep the seams of a soup from closing. Two sides along the same positions are one edge unless a
 * third one runs there, so a face that adds nothing to the surface but its sides tears it open. */
#ifndef TWEEND_FACE_FAULTS_H
#define TWEEND_FACE_FAULTS_H

#include "soup.h"

/* Marks faces with fewer than three different places. place: [vertex_count] the first vertex at each vertex's
 * place. left_out: [face_count], 1 for each face marked. Returns how many it marks. O(corners). */
uint32_t tw_mark_collapsed(const tw_soup *soup, const uint32_t *place, uint8_t *left_out);

/* Marks faces that are listed before: with the same places in the same direction, and the same material. Such
 * a face with another material is another layer, and stays. *count: how many are marked; faces marked before
 * are not looked at. O(n log n) at worst. TW_NO_MEMORY. */
tw_status tw_mark_doubled(const tw_soup *soup, const uint32_t *place, uint8_t *left_out, uint32_t *count,
                          tw_error *error);

/* Whether all corners of a face lie nearer than `height` to the line between two of them. */
bool tw_is_sliver(const tw_soup *soup, uint32_t face, double height);

#endif
