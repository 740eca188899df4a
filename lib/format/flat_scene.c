/* Moves the meshes of flat answers to their places, and reads their triangles with points. */
#include "flat.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "placement.h"

/* Far parts, and all that moves with them, are placed by their exact translations. */
static void place_part(const tw_flat_scene *flat, const tw_placement *place, double scale,
                       tw_flat_part *part) {
  part->is_mirrored = tw_matrix_cofactors(place->world, part->cofactor) < 0;
  for (int row = 0; row < 3; row++) {
    for (int column = 0; column < 3; column++)
      part->matrix[4 * row + column] = scale * (double)place->world[4 * column + row];
    double at = flat->is_moved ? place->origin[row] : (double)place->world[12 + row];
    part->matrix[4 * row + 3] = scale * (at - flat->origin[row]);
  }
}

static void place_parts(const tw_placements *places, double scale, tw_flat_scene *out) {
  for (uint32_t i = 0; i < places->count && !out->is_moved; i++) {
    out->is_moved = places->items[i].is_far;
    if (out->is_moved) memcpy(out->origin, places->items[i].origin, sizeof out->origin);
  }
  if (out->is_moved) out->far_count = tw_placements_count_far(&out->scene, places, out->origin);
  for (uint64_t points = 0; out->part_count < places->count; out->part_count++) {
    const tw_placement *place = &places->items[out->part_count];
    const tw_surface *surface = out->scene.surfaces[place->mesh];
    tw_flat_part *part = &out->parts[out->part_count];
    *part =
        (tw_flat_part){.surface = surface, .node = place->node, .mesh = place->mesh, .first_point = points};
    place_part(out, place, scale, part);
    points += tw_surface_row_count(surface, TW_DOMAIN_POINTS);
  }
}

bool tw_flat_place(const tw_scene *scene, double scale, tw_flat_scene *out) {
  tw_placements places;
  *out = (tw_flat_scene){.scene = *scene};
  bool is_placed = tw_placements_find(scene, &places);
  if (is_placed) out->parts = tw_alloc(places.count, sizeof *out->parts);
  if (out->parts) place_parts(&places, scale, out);
  if (out->parts) out->is_beyond = tw_placements_are_beyond(scene, &places, scale);
  tw_placements_deinit(&places);
  return out->parts;
}

void tw_flat_deinit(tw_flat_scene *flat) {
  tw_free(flat->parts);
}

tw_status tw_flat_check(const tw_flat_scene *flat, tw_error *error) {
  return flat->is_beyond ? tw_fail(error, TW_LIMIT, "nodes and units take coordinates beyond 3.4e38") : TW_OK;
}

tw_surface_group tw_flat_faces(const tw_surface *surface) {
  const tw_surface_counts *counts = tw_surface_get_counts(surface);
  return (tw_surface_group){
      .material = -1, .names = TW_NO_INDEX, .face_count = counts->faces, .corner_count = counts->corners};
}

void tw_flat_turn(const tw_flat_part *part, const float normal[3], float out[3]) {
  double turned[3], square = 0, sign = part->is_mirrored ? -1 : 1;
  for (int row = 0; row < 3; row++) {
    turned[row] = 0;
    for (int column = 0; column < 3; column++)
      turned[row] += sign * part->cofactor[3 * column + row] * (double)normal[column];
    square += turned[row] * turned[row];
  }
  double length = sqrt(square);
  for (int row = 0; row < 3; row++)
    out[row] = length > 0 ? (float)(turned[row] / length) + 0.0f : normal[row];
}

bool tw_flat_tools_init(tw_flat_tools *tools, const tw_surface *const *surfaces, uint32_t count) {
  *tools = (tw_flat_tools){.corner_capacity = (size_t)4 * TW_FLAT_FACES};
  for (uint32_t i = 0; i < count; i++) {
    size_t largest = tw_surface_largest_face(surfaces[i]);
    if (largest > tools->corner_capacity) tools->corner_capacity = largest;
  }
  tools->reader = tw_surface_reader_create_shared(surfaces, count, 0);
  tools->corners[0] = tw_alloc(tools->corner_capacity, sizeof(uint32_t));
  tools->places[0] = tw_alloc(tools->corner_capacity, sizeof(uint32_t));
  return tw_row_pages_init(&tools->points, TW_DOMAIN_POINTS) && tools->reader && tools->corners[0] &&
         tools->places[0] &&
         tw_triangulator_init(&tools->triangles, surfaces, count, TW_POLYGONS_TRIANGLES, tools->reader);
}

void tw_flat_tools_deinit(tw_flat_tools *tools) {
  tw_triangulator_deinit(&tools->triangles);
  tw_surface_reader_destroy(tools->reader);
  tw_row_pages_deinit(&tools->points);
  tw_row_pages_deinit(&tools->uvs);
  for (int i = 0; i < 2; i++) {
    tw_free(tools->corners[i]);
    tw_free(tools->places[i]);
  }
  tw_free(tools->sizes);
  tw_free(tools->rows);
}

static void move_pages(tw_row_pages *pages, const tw_flat_part *part) {
  float *point = pages->values;
  for (uint32_t i = 0; i < pages->count * TW_PAGE_ROWS; i++, point += 3) tw_flat_move(part, point, point);
}

uint32_t tw_flat_read_triangles(tw_flat_tools *tools, const tw_flat_part *part, uint64_t first,
                                uint64_t most) {
  const tw_surface *surface = part->surface;
  const tw_surface_group faces = tw_flat_faces(surface);
  uint32_t wanted = (uint32_t)tw_least(most, TW_FLAT_FACES), count = 0, *place = tools->places[0];
  const uint32_t *row = tools->corners[0];
  tools->triangles.domain = TW_DOMAIN_POINTS;
  tw_triangulator_read(&tools->triangles, surface, &faces, first, wanted, tools->corners[0]);
  tw_row_pages_clear(&tools->points);
  for (; count < wanted; count++, row += 3, place += 3) {
    for (int i = 0; i < 3; i++) place[i] = tw_row_pages_add(&tools->points, row[i]);
    if (place[0] == UINT32_MAX || place[1] == UINT32_MAX || place[2] == UINT32_MAX) break;
  }
  tw_row_pages_read(&tools->points, tools->reader, tw_surface_row_count(surface, TW_DOMAIN_POINTS));
  move_pages(&tools->points, part);
  return count;
}
