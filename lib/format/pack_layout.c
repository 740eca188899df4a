/* Chooses how the vertices of packs are stored, and finds the parts of packs. */
#include "pack_layout.h"

#include <string.h>

static bool is_fraction(const tw_uv_set *set) {
  for (size_t i = 0; i < 2 * (size_t)set->value_count; i++)
    if (!(set->values[i] >= 0 && set->values[i] <= 1)) return false;
  return true;
}

static bool has_small_joints(const tw_mesh *mesh) {
  for (size_t i = 0; mesh->skin.joints && i < mesh->skin.width * (size_t)mesh->point_count; i++)
    if (mesh->skin.joints[i] > UINT8_MAX) return false;
  return true;
}

/* Copies the names of attributes: packs may outlive the surface. False without memory. */
static bool keep_names(tw_packs *packs) {
  for (uint32_t i = 0; i < packs->field_count; i++) {
    const char *name = packs->fields[i].semantic;
    packs->fields[i].semantic = tw_arena_text(packs->arena, name, strlen(name));
    if (!packs->fields[i].semantic) return false;
  }
  return true;
}

bool tw_packs_choose_fields(tw_packs *packs, const tw_mesh *mesh, const tw_surface_layout *layout) {
  tw_vertex_coding places = packs->options.grid.is_float ? TW_CODED_FLOATS : TW_CODED_PLACES;
  tw_vertex_codings codings = {places,
                               TW_CODED_UNITS,
                               TW_CODED_UNITS,
                               {TW_CODED_FLOATS},
                               TW_CODED_FRACTIONS,
                               has_small_joints(mesh) ? TW_CODED_SMALL_JOINTS : TW_CODED_ROUNDED_JOINTS,
                               TW_CODED_WEIGHTS};
  for (uint32_t set = 0; set < layout->uv_count; set++)
    if (is_fraction(&mesh->uv_sets[set])) codings.uvs[set] = TW_CODED_FRACTIONS;
  packs->field_count = tw_vertex_fields(layout, &codings, packs->fields);
  memcpy(packs->fields->origin, packs->options.grid.origin, sizeof packs->fields->origin);
  packs->fields->scale = packs->options.grid.scale;
  packs->target_count = layout->morph_count;
  packs->target_step = layout->morph_width / 3;
  packs->target[0] = (tw_vertex_field){.coding = places, .width = 3, .scale = packs->fields->scale};
  packs->target[1] = (tw_vertex_field){.width = 3, .offset = tw_vertex_field_size(&packs->target[0])};
  uint32_t most = packs->target_step ? TW_DISPLACEMENTS_MAX / packs->target_step : 0;
  packs->targets_a_part = layout->morph_count < most ? layout->morph_count : most;
  uint32_t target_parts = packs->target_count ? (packs->target_count + most - 1) / most : 0;
  packs->part_count = 1 + target_parts + 1;
  return keep_names(packs);
}

uint32_t tw_packs_target_size(const tw_packs *packs) {
  return tw_vertex_size(packs->target, packs->target_step);
}

tw_pack_part tw_packs_part(const tw_packs *packs, uint32_t pack, uint32_t part) {
  const tw_pack *p = &packs->packs[pack];
  if (part == packs->part_count - 1)
    return (tw_pack_part){.count = 3 * p->triangle_count, .stride = sizeof(uint16_t)};
  if (part == 0)
    return (tw_pack_part){.has_vertices = true,
                          .count = p->vertex_count,
                          .stride = tw_vertex_size(packs->fields, packs->field_count)};
  uint32_t first = (part - 1) * packs->targets_a_part;
  uint32_t count = (uint32_t)tw_least(packs->targets_a_part, packs->target_count - first);
  return (tw_pack_part){true, first, count, p->vertex_count, count * tw_packs_target_size(packs)};
}

uint64_t tw_packs_part_size(const tw_packs *packs, uint32_t pack, uint32_t part) {
  if (packs->sizes) return packs->sizes[(size_t)pack * packs->part_count + part];
  const tw_pack_part whole = tw_packs_part(packs, pack, part);
  return (uint64_t)whole.count * whole.stride;
}

const tw_pack_bounds *tw_packs_bounds(const tw_packs *packs, uint32_t pack, int target) {
  return packs->bounds + (size_t)pack * (1 + packs->target_count) + (size_t)(target + 1);
}

void tw_packs_target_fields(const tw_packs *packs, uint32_t target_of_part, tw_vertex_field fields[2]) {
  for (uint32_t i = 0; i < packs->target_step; i++) {
    fields[i] = packs->target[i];
    fields[i].offset += target_of_part * tw_packs_target_size(packs);
  }
}
