/* Makes the classes of irregular quads, and finds them again by their neighbourhood's key. */
#include "patch_class.h"

#include <stdlib.h>
#include <string.h>

#include "refine.h"

enum {
  BUCKETS_FIRST = 16,
  BYTES_MAX = 64 << 20 /* of all classes together */
};

struct tw_patch_shapes {
  tw_arena *arena, *stencils;
  tw_patch_class **buckets; /* [bucket_count], a power of two */
  uint32_t bucket_count, class_count;
  uint32_t point_max, refined_max; /* of any class */
  uint32_t depth_max;
  bool failed; /* a class may be half made: no classes are given out any more */
};

tw_patch_shapes *tw_patch_shapes_create(void) {
  tw_patch_shapes *shapes = tw_alloc_zero(1, sizeof *shapes);
  if (!shapes) return NULL;
  shapes->arena = tw_arena_create();
  shapes->stencils = tw_arena_create();
  shapes->buckets = tw_alloc_zero(BUCKETS_FIRST, sizeof(tw_patch_class *));
  shapes->bucket_count = BUCKETS_FIRST;
  if (shapes->arena && shapes->stencils && shapes->buckets) return shapes;
  tw_patch_shapes_destroy(shapes);
  return NULL;
}

void tw_patch_shapes_destroy(tw_patch_shapes *shapes) {
  if (!shapes) return;
  tw_arena_destroy(shapes->arena);
  tw_arena_destroy(shapes->stencils);
  tw_free(shapes->buckets);
  tw_free(shapes);
}

size_t tw_patch_shapes_size(const tw_patch_shapes *shapes) {
  return sizeof *shapes + tw_arena_size(shapes->arena) + tw_arena_size(shapes->stencils) +
         shapes->bucket_count * sizeof(tw_patch_class *);
}

tw_arena *tw_patch_shapes_stencils(tw_patch_shapes *shapes) {
  return shapes->stencils;
}

uint32_t tw_patch_shapes_scratch(const tw_patch_shapes *shapes) {
  /* Each depth of the recursion stores the points of its class and the rows refined from them. */
  return (shapes->refined_max + shapes->point_max) * (shapes->depth_max + 1);
}

/* ---- making a class ------------------------------------------------------------------------- */

/* Makes a topology of the neighbourhood. Its outer rim looks like a border, but no point at the rim is
 * computed. */
static tw_status to_topology(const tw_neighbourhood *n, tw_arena *arena, tw_topology *t) {
  tw_status status =
      tw_topology_build(t, arena, n->point_count, n->face_count, NULL, 4 * n->face_count, n->quads[0]);
  if (status == TW_OK) status = tw_topology_soften(t, arena);
  if (status != TW_OK) return status;
  for (uint32_t c = 0; c < t->corner_count; c++) {
    float sharpness = n->sharpness[c / 4][c % 4];
    if (sharpness > 0) t->edge_sharpness[t->corner_edge[c]] = sharpness;
  }
  memcpy(t->vertex_sharpness, n->vertex_sharpness, 4 * sizeof(float));
  t->semi_sum = n->semi_sum;
  t->semi_count = n->semi_count;
  return TW_OK;
}

static tw_status make_masks(tw_patch_shapes *shapes, const tw_topology *t, tw_patch_class *shape) {
  tw_limit_entry *room = tw_alloc(tw_limit_greatest_capacity(t), sizeof *room);
  bool complete = room != NULL;
  for (uint32_t k = 0; k < 4 && complete; k++) {
    uint32_t count = shape->mask_counts[k] = tw_limit_mask(t, false, k, room);
    tw_limit_entry *entries = tw_arena_alloc(shapes->arena, count, sizeof *entries);
    if (entries) memcpy(entries, room, count * sizeof *entries);
    complete = entries != NULL;
    shape->masks[k] = entries;
    shape->framed[k] = tw_limit_frame(t, false, k, shape->frames[k]);
  }
  tw_free(room);
  return complete ? TW_OK : TW_NO_MEMORY;
}

/* Refining a neighbourhood: what is needed until the class has its step. */
typedef struct step {
  tw_arena *arena;
  tw_topology parent, child;
  tw_collector *collector; /* collects neighbourhoods in the child */
  tw_share *shares;        /* room for a mask */
  float *row;              /* [parent points] weights of one row */
  uint32_t *new_index;     /* [child vertices] 1 + the vertex's row in the class, 0 when it has none */
  uint32_t *rows;          /* [child vertices] the vertices that have rows, in the order of the rows */
  uint32_t row_count;
} step;

static tw_status start_step(const tw_neighbourhood *local, step *s) {
  const tw_rules rules = {.chaikin = local->chaikin};
  tw_status status = to_topology(local, s->arena, &s->parent);
  if (status == TW_OK) status = tw_refine_topology(&s->parent, &rules, s->arena, NULL, &s->child);
  if (status != TW_OK) return status;
  uint32_t children = s->child.vertex_count;
  s->shares = tw_arena_alloc(s->arena, tw_refine_mask_capacity(&s->parent), sizeof *s->shares);
  s->row = tw_arena_alloc(s->arena, local->point_count, sizeof *s->row);
  s->new_index = tw_arena_alloc(s->arena, children, sizeof *s->new_index);
  s->rows = tw_arena_alloc(s->arena, children, sizeof *s->rows);
  s->collector = tw_collector_create(&s->child, local->chaikin);
  if (!s->shares || !s->row || !s->new_index || !s->rows || !s->collector) return TW_NO_MEMORY;
  return TW_OK;
}

/* Returns the rows of these child vertices, and gives new rows to vertices that have none. NULL without
 * memory. */
static const uint32_t *take_rows(tw_patch_shapes *shapes, step *s, const uint32_t *vertices, uint32_t count) {
  uint32_t *rows = tw_arena_alloc(shapes->arena, count, sizeof *rows);
  if (!rows) return NULL;
  for (uint32_t i = 0; i < count; i++) {
    if (!s->new_index[vertices[i]]) {
      s->rows[s->row_count++] = vertices[i];
      s->new_index[vertices[i]] = s->row_count;
    }
    rows[i] = s->new_index[vertices[i]] - 1;
  }
  return rows;
}

static tw_status make_part(tw_patch_shapes *shapes, step *s, uint32_t k, uint32_t depth,
                           tw_patch_part *part) {
  /* Child quad k begins at the parent's corner k. Begun (4 - k) % 4 corners later it has its parent's
   * orientation. */
  uint32_t corner = 4 * k + (4 - k) % 4;
  uint32_t regular[16];
  const uint32_t *vertices = regular;
  uint32_t count = 16;
  if (!tw_patch_regular(&s->child, corner, regular, &part->reflected)) {
    tw_status status = tw_patch_classify(shapes, s->collector, corner, depth, &part->shape, &vertices);
    if (status != TW_OK) return status;
    count = part->shape->point_count;
  }
  part->points = take_rows(shapes, s, vertices, count);
  return part->points ? TW_OK : TW_NO_MEMORY;
}

/* Computes s->row: the weight of each point in a child vertex. The shares of face points are passed on to the
 * faces' corners. */
static void weigh_row(const step *s, uint32_t child, bool chaikin) {
  const tw_rules rules = {.chaikin = chaikin};
  const tw_topology *t = &s->parent;
  uint32_t first_face = t->vertex_count + t->edge_count;
  uint32_t count = tw_refine_mask(t, &rules, child, s->shares);
  memset(s->row, 0, t->vertex_count * sizeof *s->row);
  for (uint32_t i = 0; i < count; i++) {
    uint32_t vertex = s->shares[i].vertex;
    float weight = s->shares[i].weight;
    if (vertex < first_face) s->row[vertex] += weight;
    for (uint32_t k = 0; vertex >= first_face && k < 4; k++)
      s->row[t->corner_vertex[4 * (vertex - first_face) + k]] += weight / 4;
  }
}

static tw_status store_rows(tw_patch_shapes *shapes, const step *s, tw_patch_class *shape) {
  uint32_t width = shape->point_count, entries = 0, place = 0;
  bool chaikin = shape->local.chaikin;
  for (uint32_t r = 0; r < s->row_count; r++) {
    weigh_row(s, s->rows[r], chaikin);
    for (uint32_t i = 0; i < width; i++) entries += s->row[i] != 0;
  }
  uint32_t *offsets = tw_arena_alloc(shapes->arena, s->row_count + 1, sizeof *offsets);
  uint32_t *columns = tw_arena_alloc(shapes->arena, entries, sizeof *columns);
  float *weights = tw_arena_alloc(shapes->arena, entries, sizeof *weights);
  if (!offsets || !columns || !weights) return TW_NO_MEMORY;
  for (uint32_t r = 0; r < s->row_count; r++) {
    weigh_row(s, s->rows[r], chaikin);
    for (uint32_t i = 0; i < width; i++) {
      if (s->row[i] == 0) continue;
      columns[place] = i;
      weights[place++] = s->row[i];
    }
    offsets[r + 1] = place;
  }
  shape->refined_count = s->row_count;
  shape->row_offsets = offsets;
  shape->columns = columns;
  shape->weights = weights;
  if (s->row_count > shapes->refined_max) shapes->refined_max = s->row_count;
  return TW_OK;
}

static tw_status refine_class(tw_patch_shapes *shapes, tw_patch_class *shape, uint32_t depth) {
  step s = {.arena = tw_arena_create()};
  tw_status status = s.arena ? start_step(&shape->local, &s) : TW_NO_MEMORY;
  for (uint32_t k = 0; k < 4 && status == TW_OK; k++)
    status = make_part(shapes, &s, k, depth - 1, &shape->parts[k]);
  if (status == TW_OK) status = store_rows(shapes, &s, shape);
  tw_collector_destroy(s.collector);
  tw_arena_destroy(s.arena);
  return status;
}

/* Makes a class ready for `depth` steps. Depth is at most TW_LEVEL_MAX, which also bounds the recursion. */
static tw_status deepen(tw_patch_shapes *shapes, tw_patch_class *shape, uint32_t depth) {
  if (depth > shapes->depth_max) shapes->depth_max = depth;
  if (shape->depth >= depth) return TW_OK;
  shape->depth = depth; /* set before recursing: a class is often its own quarter */
  if (!shape->row_offsets) return refine_class(shapes, shape, depth);
  for (uint32_t k = 0; k < 4; k++) {
    if (!shape->parts[k].shape) continue;
    tw_status status = deepen(shapes, shape->parts[k].shape, depth - 1);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

/* ---- the table of classes ------------------------------------------------------------------- */

/* The start of the chain for a hash. */
static tw_patch_class **bucket_of(const tw_patch_shapes *shapes, uint32_t hash) {
  return &shapes->buckets[hash & (shapes->bucket_count - 1)];
}

static tw_patch_class *find_class(const tw_patch_shapes *shapes, const tw_neighbourhood *n) {
  for (tw_patch_class *c = *bucket_of(shapes, n->hash); c; c = c->next)
    if (c->local.hash == n->hash && c->local.chaikin == n->chaikin && c->local.key_size == n->key_size &&
        c->point_count == n->point_count && memcmp(c->local.quads, n->quads, n->key_size) == 0)
      return c;
  return NULL;
}

static void link_class(tw_patch_shapes *shapes, tw_patch_class *shape) {
  tw_patch_class **bucket = bucket_of(shapes, shape->local.hash);
  shape->next = *bucket;
  *bucket = shape;
}

/* Doubles the number of buckets. Without memory the table stays as it is, with longer chains. */
static void add_buckets(tw_patch_shapes *shapes) {
  uint32_t count = shapes->bucket_count;
  tw_patch_class **old = shapes->buckets, **buckets = tw_alloc_zero(2 * (size_t)count, sizeof *buckets);
  if (!buckets) return;
  shapes->buckets = buckets;
  shapes->bucket_count = 2 * count;
  for (uint32_t i = 0; i < count; i++)
    for (tw_patch_class *shape = old[i], *next; shape; shape = next) {
      next = shape->next;
      link_class(shapes, shape);
    }
  tw_free(old);
}

/* Makes the class of a neighbourhood. Its refinement step is made when a depth is asked for. */
static tw_status make_class(tw_patch_shapes *shapes, const tw_neighbourhood *n, tw_patch_class **out) {
  tw_patch_class *shape = tw_arena_alloc(shapes->arena, 1, sizeof *shape);
  void *key = tw_arena_alloc(shapes->arena, 1, n->key_size);
  tw_arena *scratch = tw_arena_create();
  tw_status status = TW_NO_MEMORY;
  if (shape && key && scratch) {
    memcpy(key, n->quads, n->key_size);
    shape->local = tw_neighbourhood_lay_out(key, n->point_count, n->face_count, n->chaikin);
    shape->local.hash = n->hash;
    shape->point_count = n->point_count;
    tw_topology topology;
    status = to_topology(&shape->local, scratch, &topology);
    if (status == TW_OK) status = make_masks(shapes, &topology, shape);
  }
  tw_arena_destroy(scratch);
  *out = shape;
  return status;
}

static tw_status add_class(tw_patch_shapes *shapes, const tw_neighbourhood *n, tw_patch_class **out) {
  if (tw_arena_size(shapes->arena) > BYTES_MAX) return TW_LIMIT;
  tw_status status = make_class(shapes, n, out);
  if (status != TW_OK) return status;
  if (n->point_count > shapes->point_max) shapes->point_max = n->point_count;
  link_class(shapes, *out);
  if (++shapes->class_count > shapes->bucket_count) add_buckets(shapes);
  return TW_OK;
}

tw_status tw_patch_classify(tw_patch_shapes *shapes, tw_collector *collector, uint32_t corner, uint32_t depth,
                            tw_patch_class **out, const uint32_t **points) {
  const tw_neighbourhood *found = tw_collector_find(collector, corner, points);
  if (!found || shapes->failed) return TW_LIMIT;
  tw_patch_class *shape = find_class(shapes, found);
  tw_status status = shape ? TW_OK : add_class(shapes, found, &shape);
  if (status == TW_OK) status = deepen(shapes, shape, depth);
  shapes->failed = status != TW_OK;
  *out = shape;
  return status;
}
