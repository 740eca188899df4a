/* Frames of a level's vertices, and the displacement of vertices in them. */
#include "level_detail.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "limit.h"
#include "refine.h"
#include "tweend/detail.h"
#include "vector3.h"

tw_detail_list tw_coarser_details(const tw_detail_list *list, uint32_t level) {
  tw_detail_list above = {0, list->details};
  while (above.count < list->count && list->details[above.count].level < level) above.count++;
  return above;
}

/* Checks that generic steps can make the level with all of its vertices, and that the scheme is one that has
 * details. Details do not say their scheme, and the bilinear one makes as many vertices as Catmull and
 * Clark's. */
static tw_status check_level(const tw_cage *cage, const tw_surface_options *options, uint32_t level,
                             tw_error *error) {
  if (options->scheme == TW_BILINEAR)
    return tw_fail(error, TW_INVALID, "scheme=bilinear is not what details are modelled by");
  if (tw_cage_shrinks(cage, options))
    return tw_fail(error, TW_INVALID, "boundary=open takes points away that details are of");
  if (tw_cage_counts_at(cage, options->scheme == TW_LOOP, level).faces > TW_GENERIC_FACES_MAX)
    return tw_fail(error, TW_LIMIT, "details are limited to levels of %d faces, holes included",
                   TW_GENERIC_FACES_MAX);
  return TW_OK;
}

tw_status tw_details_check(const tw_detail_list *list, const tw_cage *cage, const tw_surface_options *options,
                           tw_error *error) {
  for (uint32_t i = 0; i < list->count; i++) {
    const tw_detail *d = &list->details[i];
    uint64_t vertices = tw_cage_counts_at(cage, options->scheme == TW_LOOP, d->level).vertices;
    tw_status status =
        vertices == d->vertex_count
            ? check_level(cage, options, d->level, error)
            : tw_fail(error, TW_INVALID,
                      "what is modelled onto level %u is of %u %s, where this scheme makes %llu", d->level,
                      d->vertex_count, tw_plural(d->vertex_count, "point", "points"),
                      (unsigned long long)vertices);
    if (status == TW_OK) continue;
    tw_error_at(error, "/details/%u", i);
    return status;
  }
  return TW_OK;
}

/* ---- frames ---------------------------------------------------------------------------------- */

/* The points of a level, and room for a mask. */
struct tw_detail_frames {
  const tw_topology *topology;
  bool linear;
  const double *positions;
  tw_limit_entry *mask;
};

static void subtract(const tw_detail_frames *f, uint32_t to, uint32_t from, double out[3]) {
  for (int c = 0; c < 3; c++)
    out[c] = f->positions[3 * (size_t)to + (size_t)c] - f->positions[3 * (size_t)from + (size_t)c];
}

/* Makes the vector unit. Returns false, and leaves the vector alone, where it may be mere rounding of points
 * to float. scale: the length of the edges there (its square for cross products). The threshold is far over
 * float's 6e-8, because differences of near points have lost most of their digits. */
static bool make_unit(double vector[3], double scale) {
  double length = sqrt(tw_dot3(vector, vector));
  if (!(length > 1e-5 * scale)) return false;
  for (int c = 0; c < 3; c++) vector[c] /= length;
  return true;
}

/* Finds the limit's normal; where it has none, the normal of the corner's face; else +Y. */
static void find_normal(const tw_detail_frames *f, uint32_t corner, double normal[3]) {
  const tw_topology *t = f->topology;
  double tangents[2][3] = {{0}, {0}}, from[3];
  uint32_t vertex = t->corner_vertex[corner], count = tw_limit_mask(t, f->linear, corner, f->mask);
  for (uint32_t i = 0; i < count; i++) {
    subtract(f, f->mask[i].vertex, vertex, from);
    for (int c = 0; c < 3; c++) {
      tangents[0][c] += (double)f->mask[i].tangent1 * from[c];
      tangents[1][c] += (double)f->mask[i].tangent2 * from[c];
    }
  }
  tw_cross3(tangents[0], tangents[1], normal);
  if (make_unit(normal, fmax(tw_dot3(tangents[0], tangents[0]), tw_dot3(tangents[1], tangents[1])))) return;
  uint32_t next = t->corner_vertex[tw_corner_next(t, corner)],
           before = t->corner_vertex[tw_corner_previous(t, corner)];
  subtract(f, next, vertex, tangents[0]);
  subtract(f, before, vertex, tangents[1]);
  tw_cross3(tangents[0], tangents[1], normal);
  if (make_unit(normal, fmax(tw_dot3(tangents[0], tangents[0]), tw_dot3(tangents[1], tangents[1])))) return;
  memcpy(normal, (const double[3]){0, 1, 0}, 3 * sizeof *normal);
}

/* Finds a unit tangent orthogonal to the normal: along the edge to the next corner, else to the previous one,
 * else along an axis. */
static void find_tangent(const tw_detail_frames *f, uint32_t corner, const double normal[3],
                         double tangent[3]) {
  const tw_topology *t = f->topology;
  uint32_t vertex = t->corner_vertex[corner];
  for (int attempt = 0; attempt < 5; attempt++) {
    if (attempt < 2)
      subtract(f, t->corner_vertex[attempt ? tw_corner_previous(t, corner) : tw_corner_next(t, corner)],
               vertex, tangent);
    else
      for (int c = 0; c < 3; c++) tangent[c] = c == attempt - 2;
    double along = tw_dot3(tangent, normal), length = sqrt(tw_dot3(tangent, tangent));
    for (int c = 0; c < 3; c++) tangent[c] -= along * normal[c];
    if (make_unit(tangent, length)) return;
  }
}

/* The mean length of the edges at a vertex; 1 where all have length 0. */
static double edge_length(const tw_detail_frames *f, uint32_t vertex) {
  const tw_topology *t = f->topology;
  double sum = 0, edge[3];
  uint32_t begin = t->ring_offsets[vertex], end = t->ring_offsets[vertex + 1];
  for (uint32_t i = begin; i < end; i++) {
    subtract(f, tw_far_end(t, t->ring_edges[i], vertex), vertex, edge);
    sum += sqrt(tw_dot3(edge, edge));
  }
  return sum > 0 ? sum / (end - begin) : 1;
}

/* Finds the frame: tangent, bitangent and normal, each as long as the mean of the edges. Returns that
 * length. */
static double find_frame(const tw_detail_frames *f, uint32_t vertex, double frame[3][3]) {
  uint32_t corner = f->topology->fan_corners[f->topology->fan_offsets[vertex]];
  double scale = edge_length(f, vertex);
  find_normal(f, corner, frame[2]);
  find_tangent(f, corner, frame[2], frame[0]);
  tw_cross3(frame[2], frame[0], frame[1]);
  for (int axis = 0; axis < 3; axis++)
    for (int c = 0; c < 3; c++) frame[axis][c] *= scale;
  return scale;
}

tw_status tw_detail_frames_create(const tw_detail_level *level, const tw_rules *rules, tw_arena *arena,
                                  tw_detail_frames **out) {
  tw_detail_frames *frames = *out = tw_arena_alloc(arena, 1, sizeof *frames);
  if (!frames) return TW_NO_MEMORY;
  *frames = (tw_detail_frames){&level->topology, rules->linear, level->positions, NULL};
  frames->mask =
      tw_arena_alloc_raw(arena, tw_limit_greatest_capacity(&level->topology), sizeof *frames->mask);
  return frames->mask ? TW_OK : TW_NO_MEMORY;
}

bool tw_detail_move(tw_detail_frames *frames, uint32_t vertex, const double by[3], float offsets[3]) {
  double frame[3][3], scale = find_frame(frames, vertex, frame);
  bool fits = true;
  for (int axis = 0; axis < 3; axis++) {
    offsets[axis] = (float)(offsets[axis] + tw_dot3(frame[axis], by) / (scale * scale));
    fits &= fabsf(offsets[axis]) <= TW_COORDINATE_MAX;
  }
  return fits;
}

/* ---- adding ---------------------------------------------------------------------------------- */

typedef struct adding {
  const tw_detail *detail;
  const tw_detail_frames *level;
  uint32_t capacity;
  double *positions;
  atomic_bool failed;
} adding;

/* Clamps a coordinate: beyond TW_COORDINATE_MAX float could overflow on the way to normals. */
static double in_range(double coordinate) {
  return fmax(-(double)TW_COORDINATE_MAX, fmin(coordinate, (double)TW_COORDINATE_MAX));
}

static void add_vertices(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  adding *a = context;
  tw_detail_frames frames = *a->level;
  (void)part;
  frames.mask = tw_alloc(a->capacity, sizeof *frames.mask);
  if (!frames.mask) atomic_store(&a->failed, true);
  for (uint32_t v = begin; frames.mask && v < end; v++) {
    const float *offsets = a->detail->offsets + 3 * (size_t)v;
    double frame[3][3], *point = a->positions + 3 * (size_t)v;
    memcpy(point, frames.positions + 3 * (size_t)v, 3 * sizeof *point);
    if (offsets[0] == 0 && offsets[1] == 0 && offsets[2] == 0) continue;
    find_frame(&frames, v, frame);
    for (int c = 0; c < 3; c++) {
      for (int axis = 0; axis < 3; axis++) point[c] += (double)offsets[axis] * frame[axis][c];
      point[c] = in_range(point[c]);
    }
  }
  tw_free(frames.mask);
}

/* Writes the displaced positions to `after`. All frames are computed from `before`, in which no vertex has
 * moved. */
static tw_status add_detail(const tw_detail *detail, const tw_topology *t, bool linear,
                            const tw_parallel_for *parallel, const double *before, double *after) {
  const tw_detail_frames level = {t, linear, before, NULL};
  adding a = {
      .detail = detail, .level = &level, .capacity = tw_limit_greatest_capacity(t), .positions = after};
  /* A frame takes as long as several iterations that TW_PARALLEL_FOR_LEAST counts in. */
  tw_parallel_for_run(parallel, t->vertex_count, TW_PARALLEL_FOR_LEAST / 8, add_vertices, &a);
  return atomic_load(&a.failed) ? TW_NO_MEMORY : TW_OK;
}

static tw_status add_own(const tw_detail_step *step, const tw_detail *detail, const tw_parallel_for *parallel,
                         double *positions) {
  size_t count = 3 * (size_t)step->topology->vertex_count;
  double *before = tw_alloc(count, sizeof *before);
  if (!before) return TW_NO_MEMORY;
  memcpy(before, positions, count * sizeof *before);
  tw_status status = add_detail(detail, step->topology, step->rules->linear, parallel, before, positions);
  tw_free(before);
  return status;
}

static const tw_detail *detail_of(const tw_detail_list *list, uint32_t level) {
  for (uint32_t i = 0; i < list->count; i++)
    if (list->details[i].level == level) return &list->details[i];
  return NULL;
}

static double *refine_values(const tw_topology *parent, const tw_rules *rules, const tw_topology *child,
                             const tw_parallel_for *parallel, tw_arena *arena, const double *in) {
  double *out = tw_arena_alloc_raw(arena, child->vertex_count, 3 * sizeof *out);
  return out && tw_refine_values(parent, rules, 3, in, parallel, out) == TW_OK ? out : NULL;
}

/* Displaces the vertices of a level by what deeper details displace them on the deepest level: refines the
 * level with the details (`modelled`) and without them (`plain`), and adds the difference. Both are one array
 * until the first detail. */
static tw_status add_deeper_details(const tw_detail_step *step, const tw_parallel_for *parallel,
                                    tw_arena *arena, double *positions) {
  tw_topology parent = *step->topology, child;
  const double *plain = positions, *modelled = positions;
  for (uint32_t level = step->level + 1; level <= tw_deepest_detail(step->list); level++, parent = child) {
    const tw_detail *detail = detail_of(step->list, level);
    tw_status status = tw_refine_topology(&parent, step->rules, arena, parallel, &child);
    if (status == TW_OK) status = tw_parallel_for_status(parallel);
    if (status != TW_OK) return status;
    double *next_plain = refine_values(&parent, step->rules, &child, parallel, arena, plain),
           *moved = next_plain, *next;
    if (modelled != plain) moved = refine_values(&parent, step->rules, &child, parallel, arena, modelled);
    next = detail ? tw_arena_alloc_raw(arena, child.vertex_count, 3 * sizeof *next) : moved;
    if (!next_plain || !moved || !next) return TW_NO_MEMORY;
    if (detail) status = add_detail(detail, &child, step->rules->linear, parallel, moved, next);
    if (status != TW_OK) return status;
    plain = next_plain;
    modelled = next;
  }
  for (size_t i = 0; i < 3 * (size_t)step->topology->vertex_count; i++)
    positions[i] = in_range(positions[i] + (modelled[i] - plain[i]));
  return TW_OK;
}

tw_status tw_details_add(const tw_detail_step *step, const tw_parallel_for *parallel, double *positions) {
  if (step->level > step->answer) return TW_OK;
  const tw_detail *own = detail_of(step->list, step->level);
  tw_status status = own ? add_own(step, own, parallel, positions) : TW_OK;
  if (status != TW_OK || step->level < step->answer || tw_deepest_detail(step->list) <= step->level)
    return status;
  tw_arena *arena = tw_arena_create();
  status = arena ? add_deeper_details(step, parallel, arena, positions) : TW_NO_MEMORY;
  tw_arena_destroy(arena);
  return status;
}

/* ---- a level of a mesh ----------------------------------------------------------------------- */

tw_status tw_detail_level_of(const tw_mesh *mesh, const tw_surface_options *options,
                             const tw_parallel_for *parallel, tw_arena *arena, tw_detail_level *out,
                             tw_error *error) {
  const tw_detail_list all = {mesh->detail_count, mesh->details},
                       list = tw_coarser_details(&all, options->level);
  const tw_rules rules = tw_rules_of(options);
  tw_cage cage;
  tw_status status = tw_cage_read(mesh, options, arena, &cage);
  if (status == TW_OK) status = tw_details_check(&list, &cage, options, error);
  if (status == TW_OK) status = check_level(&cage, options, options->level, error);
  if (status != TW_OK) return status;
  out->point_of = cage.point_of;
  out->topology = cage.topology;
  out->positions = tw_arena_alloc_raw(arena, cage.topology.vertex_count, 3 * sizeof *out->positions);
  if (!out->positions) return TW_NO_MEMORY;
  tw_cage_gather(mesh->positions, cage.point_of, cage.topology.vertex_count, out->positions);
  for (uint32_t level = 1; level <= options->level; level++) {
    const tw_topology parent = out->topology;
    status = tw_refine_topology(&parent, &rules, arena, parallel, &out->topology);
    if (status != TW_OK) return status;
    out->positions = refine_values(&parent, &rules, &out->topology, parallel, arena, out->positions);
    if (!out->positions) return TW_NO_MEMORY;
    /* The answer's level is deeper than any, so that no level gets displacements of deeper ones. */
    const tw_detail_step step = {&list, &out->topology, &rules, level, TW_LEVEL_MAX + 1};
    status = tw_details_add(&step, parallel, out->positions);
    if (status == TW_OK) status = tw_parallel_for_status(parallel);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

tw_status tw_mesh_check_details(const tw_mesh *mesh, tw_error *error) {
  const tw_detail_list list = {mesh->detail_count, mesh->details};
  const tw_surface_options catmull_clark = {0}, loop = {.scheme = TW_LOOP};
  tw_cage cage;
  if (list.count == 0) return TW_OK;
  tw_arena *arena = tw_arena_create();
  tw_status status = arena ? tw_cage_read(mesh, &catmull_clark, arena, &cage) : TW_NO_MEMORY;
  bool triangles = status == TW_OK && cage.topology.face_size == 3;
  if (status == TW_OK && (!triangles || tw_details_check(&list, &cage, &loop, NULL) != TW_OK))
    status = tw_details_check(&list, &cage, &catmull_clark, error);
  tw_arena_destroy(arena);
  return status == TW_NO_MEMORY ? tw_fail(error, status, "out of memory") : status;
}
