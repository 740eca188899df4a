/* Makes packs: cuts the faces of a surface by a pass over their indices, and measures what is cut. */
#include <float.h>
#include <stdlib.h>

#include "array.h"
#include "pack_reader.h"
#include "parallel_for.h"

/* ---- cutting --------------------------------------------------------------------------------- */

enum { BLOCK = 4096 }; /* triangles that are read at once */

typedef struct cutter {
  tw_surface_reader *reader;
  tw_triangulator triangles;
  tw_vertex_set set;
  uint32_t block[3 * BLOCK];
} cutter;

/* The longest pack that begins with triangle `first` of a run. Polygons stay whole: a pack ends where another
 * fan begins, unless one fan alone is too large. */
static tw_pack next_pack(cutter *c, const tw_surface *surface, const tw_surface_group *faces, uint32_t run,
                         uint64_t first) {
  uint64_t total = tw_count_triangles(faces), fan_begin = first;
  uint32_t vertices_before_fan = 0, fan_vertex = UINT32_MAX, places[3];
  tw_vertex_set_clear(&c->set);
  for (uint64_t from = first; from < total; from += BLOCK) {
    uint32_t count = (uint32_t)tw_least(BLOCK, total - from);
    tw_triangulator_read(&c->triangles, surface, faces, from, count, c->block);
    for (uint32_t i = 0; i < count; i++) {
      uint32_t before = c->set.count;
      uint64_t here = from + i;
      if (c->block[3 * (size_t)i] != fan_vertex) {
        fan_vertex = c->block[3 * (size_t)i];
        fan_begin = here;
        vertices_before_fan = before;
      }
      bool has_room = here - first < TW_PACK_TRIANGLES_MAX;
      if (has_room && tw_vertex_set_add_triangle(&c->set, c->block + 3 * (size_t)i, places)) continue;
      if (fan_begin > first) return (tw_pack){run, first, (uint32_t)(fan_begin - first), vertices_before_fan};
      return (tw_pack){run, first, (uint32_t)(here - first), before};
    }
  }
  return (tw_pack){run, first, (uint32_t)(total - first), c->set.count};
}

static bool add_pack(tw_packs *packs, tw_pack pack) {
  tw_pack *grown = tw_array_grow(packs->packs, packs->pack_count, sizeof *grown, &packs->pack_room);
  if (!grown) return false;
  packs->packs = grown;
  packs->packs[packs->pack_count++] = pack;
  if (pack.vertex_count > packs->vertices_max) packs->vertices_max = pack.vertex_count;
  if (pack.triangle_count > packs->triangles_max) packs->triangles_max = pack.triangle_count;
  return true;
}

static tw_status cut_runs(tw_packs *packs, const tw_surface *surface, cutter *c,
                          const tw_parallel_for *parallel) {
  packs->runs = tw_arena_alloc(packs->arena, tw_surface_group_count(surface), sizeof *packs->runs);
  if (!packs->runs) return TW_NO_MEMORY;
  for (uint32_t group = 0; group < tw_surface_group_count(surface);) {
    tw_pack_run *run = &packs->runs[packs->run_count];
    run->first_group = group;
    run->faces = tw_take_material(surface, &group);
    run->group_count = group - run->first_group;
    uint64_t total = tw_count_triangles(&run->faces);
    for (uint64_t first = 0; first < total;) {
      tw_status status = tw_parallel_for_status(parallel);
      if (status != TW_OK) return status;
      tw_pack pack = next_pack(c, surface, &run->faces, packs->run_count, first);
      if (!add_pack(packs, pack)) return TW_NO_MEMORY;
      first += pack.triangle_count;
    }
    packs->run_count++;
  }
  return TW_OK;
}

static tw_status cut(tw_packs *packs, const tw_surface *surface, const tw_parallel_for *parallel) {
  cutter *c = tw_alloc_zero(1, sizeof *c);
  if (!c) return TW_NO_MEMORY;
  c->reader = tw_surface_reader_create_shared(&surface, 1, TW_DISPLACEMENTS_MAX);
  bool is_ready = tw_vertex_set_init(&c->set) && c->reader &&
                  tw_triangulator_init(&c->triangles, &surface, 1, packs->options.polygons, c->reader);
  tw_status status = is_ready ? cut_runs(packs, surface, c, parallel) : TW_NO_MEMORY;
  tw_triangulator_deinit(&c->triangles);
  tw_surface_reader_destroy(c->reader);
  tw_vertex_set_deinit(&c->set);
  tw_free(c);
  return status;
}

/* ---- measuring ------------------------------------------------------------------------------- */

enum { PACKS_AT_ONCE = 64 /* between two checks for cancellation */ };

typedef struct measuring {
  tw_packs *packs;
  const tw_surface *surface;
  uint32_t first; /* the pack that the parallel loop begins with */
  bool failed[TW_PARALLEL_FOR_PARTS_MAX];
} measuring;

static void bound_field(const tw_pack_reader *r, const tw_vertex_field *field, const tw_pack_part *part,
                        tw_pack_bounds *bounds) {
  *bounds = (tw_pack_bounds){{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};
  for (uint32_t i = 0; i < part->count; i++)
    tw_vertex_widen(field, tw_pack_reader_bytes(r) + (size_t)i * part->stride, bounds->min, bounds->max);
}

static bool measure_part(tw_pack_reader *r, const measuring *m, uint32_t pack, uint32_t part) {
  tw_packs *packs = m->packs;
  const tw_pack_part whole = tw_packs_part(packs, pack, part);
  tw_pack_bounds *bounds = packs->bounds + (size_t)pack * (1 + packs->target_count);
  if (!tw_pack_reader_turn(r, packs, m->surface, pack, part)) return false;
  if (part == 0) bound_field(r, packs->fields, &whole, bounds);
  for (uint32_t i = 0; i < whole.target_count; i++) {
    tw_vertex_field fields[2];
    tw_packs_target_fields(packs, i, fields);
    bound_field(r, fields, &whole, bounds + 1 + whole.first_target + i);
  }
  if (packs->options.encoding == TW_ENCODING_MESHOPT)
    packs->sizes[(size_t)pack * packs->part_count + part] = (uint32_t)tw_pack_reader_encoded_size(r);
  return true;
}

static void measure_packs(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  measuring *m = context;
  const tw_packs *packs = m->packs;
  tw_pack_reader *r = tw_pack_reader_create(&packs, &m->surface, 1);
  bool done = r;
  for (uint32_t pack = m->first + begin; done && pack < m->first + end; pack++)
    for (uint32_t i = 0; done && i < packs->part_count; i++) done = measure_part(r, m, pack, i);
  m->failed[part] = !done;
  tw_pack_reader_destroy(r);
}

static tw_status measure(tw_packs *packs, const tw_surface *surface, const tw_parallel_for *parallel) {
  measuring m = {.packs = packs, .surface = surface};
  packs->bounds =
      tw_arena_alloc(packs->arena, packs->pack_count, (1 + packs->target_count) * sizeof *packs->bounds);
  if (packs->options.encoding == TW_ENCODING_MESHOPT)
    packs->sizes = tw_arena_alloc(packs->arena, packs->pack_count, packs->part_count * sizeof *packs->sizes);
  if (!packs->bounds || (packs->options.encoding == TW_ENCODING_MESHOPT && !packs->sizes))
    return TW_NO_MEMORY;
  for (uint32_t taken; m.first < packs->pack_count; m.first += taken) {
    tw_status status = tw_parallel_for_status(parallel);
    if (status != TW_OK) return status;
    taken = packs->pack_count - m.first < PACKS_AT_ONCE ? packs->pack_count - m.first : PACKS_AT_ONCE;
    tw_parallel_for_run(parallel, taken, 1, measure_packs, &m);
    for (int i = 0; i < TW_PARALLEL_FOR_PARTS_MAX; i++)
      if (m.failed[i]) return TW_NO_MEMORY;
  }
  return TW_OK;
}

/* ---- the whole ------------------------------------------------------------------------------- */

static tw_status build(tw_packs *packs, const tw_mesh *mesh, const tw_surface *surface,
                       const tw_parallel_for *parallel) {
  packs->arena = tw_arena_create();
  if (!packs->arena) return TW_NO_MEMORY;
  if (!tw_packs_choose_fields(packs, mesh, tw_surface_get_layout(surface))) return TW_NO_MEMORY;
  if (tw_surface_get_counts(surface)->faces == 0) return TW_OK;
  tw_status status = cut(packs, surface, parallel);
  return status == TW_OK && packs->options.is_measured ? measure(packs, surface, parallel) : status;
}

tw_status tw_packs_create(const tw_mesh *mesh, const tw_surface *surface, const tw_pack_options *options,
                          const tw_parallel_for *parallel, tw_packs **out, tw_error *error) {
  tw_packs *packs = tw_alloc_zero(1, sizeof *packs);
  if (packs) packs->options = *options;
  tw_status status = packs ? build(packs, mesh, surface, parallel) : TW_NO_MEMORY;
  if (status == TW_OK) {
    *out = packs;
    return TW_OK;
  }
  tw_packs_destroy(packs);
  if (status == TW_CANCELLED) return tw_fail(error, status, "the packs are not wanted any more");
  return tw_fail(error, status, "no memory for the packs of a surface");
}

void tw_packs_destroy(tw_packs *packs) {
  if (!packs) return;
  tw_arena_destroy(packs->arena);
  tw_free(packs->packs);
  tw_free(packs);
}

size_t tw_packs_size(const tw_packs *packs) {
  return sizeof *packs + tw_arena_size(packs->arena) + packs->pack_room * sizeof *packs->packs;
}
