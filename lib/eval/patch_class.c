/* Makes the classes of irregular quads, and finds them again by their neighbourhood's key. */
#include "patch_class.h"

#include <stdlib.h>
#include <string.h>

#include "refine.h"

enum {
  BUCKETS_FIRST = 16,
  BYTES_MAX = 64 << 20 /* of all classes together */
};

struct tw_patch_classes {
  tw_arena *arena, *stencils;
  tw_patch_class **buckets; /* [bucket_count], a power of two */
  uint32_t bucket_count, class_count;
  uint32_t point_max, refined_max; /* of any class */
  uint32_t depth_max;
  bool failed; /* a class may be half made: no classes are given out any more */
};

tw_patch_classes *tw_patch_classes_create(void) {
  tw_patch_classes *classes = tw_alloc_zero(1, sizeof *classes);
  if (!classes) return NULL;
  classes->arena = tw_arena_create();
  classes->stencils = tw_arena_create();
  classes->buckets = tw_alloc_zero(BUCKETS_FIRST, sizeof(tw_patch_class *));
  classes->bucket_count = BUCKETS_FIRST;
  if (classes->arena && classes->stencils && classes->buckets) return classes;
  tw_patch_classes_destroy(classes);
  return NULL;
}

void tw_patch_classes_destroy(tw_patch_classes *classes) {
  if (!classes) return;
  tw_arena_destroy(classes->arena);
  tw_arena_destroy(classes->stencils);
  tw_free(classes->buckets);
  tw_free(classes);
}

size_t tw_patch_classes_size(const tw_patch_classes *classes) {
  return sizeof *classes + tw_arena_size(classes->arena) + tw_arena_size(classes->stencils) +
         classes->bucket_count * sizeof(tw_patch_class *);
}

tw_arena *tw_patch_classes_stencils(tw_patch_classes *classes) {
  return classes->stencils;
}

uint32_t tw_patch_classes_scratch(const tw_patch_classes *classes) {
  /* Each depth of the recursion stores the points of its class and the rows refined from them. */
  return (classes->refined_max + classes->point_max) * (classes->depth_max + 1);
}

/* ---- making a class -------------------------------------------------------------------------- */

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

static tw_status make_masks(tw_patch_classes *classes, const tw_topology *t, tw_patch_class *class) {
  tw_limit_entry *room = tw_alloc(tw_limit_greatest_capacity(t), sizeof *room);
  bool complete = room != NULL;
  for (uint32_t k = 0; k < 4 && complete; k++) {
    uint32_t count = class->mask_counts[k] = tw_limit_mask(t, false, k, room);
    tw_limit_entry *entries = tw_arena_alloc(classes->arena, count, sizeof *entries);
    if (entries) memcpy(entries, room, count * sizeof *entries);
    complete = entries != NULL;
    class->masks[k] = entries;
    class->framed[k] = tw_limit_frame(t, false, k, class->frames[k]);
  }
  tw_free(room);
  return complete ? TW_OK : TW_NO_MEMORY;
}

/* Refining a neighbourhood: what is needed until the class has its step. */
typedef struct class_step {
  tw_arena *arena;
  tw_topology parent, child;
  tw_collector *collector; /* collects neighbourhoods in the child */
  tw_share *shares;        /* room for a mask */
  float *row;              /* [parent points] weights of one row */
  uint32_t *new_index;     /* [child vertices] 1 + the vertex's row in the class, 0 when it has none */
  uint32_t *rows;          /* [child vertices] the vertices that have rows, in the order of the rows */
  uint32_t row_count;
} class_step;

static tw_status start_step(const tw_neighbourhood *local, class_step *s) {
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
static const uint32_t *take_rows(tw_patch_classes *classes, class_step *s, const uint32_t *vertices,
                                 uint32_t count) {
  uint32_t *rows = tw_arena_alloc(classes->arena, count, sizeof *rows);
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

static tw_status make_part(tw_patch_classes *classes, class_step *s, uint32_t k, uint32_t depth,
                           tw_patch_part *part) {
  /* Child quad k begins at the parent's corner k. Begun (4 - k) % 4 corners later it has its parent's
   * orientation. */
  uint32_t corner = 4 * k + (4 - k) % 4;
  uint32_t regular[16];
  const uint32_t *vertices = regular;
  uint32_t count = 16;
  if (!tw_patch_regular(&s->child, corner, regular, &part->reflected)) {
    tw_status status = tw_patch_classify(classes, s->collector, corner, depth, &part->class, &vertices);
    if (status != TW_OK) return status;
    count = part->class->point_count;
  }
  part->points = take_rows(classes, s, vertices, count);
  return part->points ? TW_OK : TW_NO_MEMORY;
}

/* Computes s->row: the weight of each point in a child vertex. The shares of face points are passed on to the
 * faces' corners. */
static void weigh_row(const class_step *s, uint32_t child, bool chaikin) {
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

static tw_status store_rows(tw_patch_classes *classes, const class_step *s, tw_patch_class *class) {
  uint32_t width = class->point_count, entries = 0, place = 0;
  bool chaikin = class->local.chaikin;
  for (uint32_t r = 0; r < s->row_count; r++) {
    weigh_row(s, s->rows[r], chaikin);
    for (uint32_t i = 0; i < width; i++) entries += s->row[i] != 0;
  }
  uint32_t *offsets = tw_arena_alloc(classes->arena, s->row_count + 1, sizeof *offsets);
  uint32_t *columns = tw_arena_alloc(classes->arena, entries, sizeof *columns);
  float *weights = tw_arena_alloc(classes->arena, entries, sizeof *weights);
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
  class->refined_count = s->row_count;
  class->row_offsets = offsets;
  class->columns = columns;
  class->weights = weights;
  if (s->row_count > classes->refined_max) classes->refined_max = s->row_count;
  return TW_OK;
}

static tw_status refine_class(tw_patch_classes *classes, tw_patch_class *class, uint32_t depth) {
  class_step s = {.arena = tw_arena_create()};
  tw_status status = s.arena ? start_step(&class->local, &s) : TW_NO_MEMORY;
  for (uint32_t k = 0; k < 4 && status == TW_OK; k++)
    status = make_part(classes, &s, k, depth - 1, &class->parts[k]);
  if (status == TW_OK) status = store_rows(classes, &s, class);
  tw_collector_destroy(s.collector);
  tw_arena_destroy(s.arena);
  return status;
}

/* Makes a class ready for `depth` steps. Depth is at most TW_LEVEL_MAX, which also bounds the recursion. */
static tw_status deepen(tw_patch_classes *classes, tw_patch_class *class, uint32_t depth) {
  if (depth > classes->depth_max) classes->depth_max = depth;
  if (class->depth >= depth) return TW_OK;
  class->depth = depth; /* set before recursing: a class is often its own quarter */
  if (!class->row_offsets) return refine_class(classes, class, depth);
  for (uint32_t k = 0; k < 4; k++) {
    if (!class->parts[k].class) continue;
    tw_status status = deepen(classes, class->parts[k].class, depth - 1);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

/* ---- the table of classes -------------------------------------------------------------------- */

/* The start of the chain for a hash. */
static tw_patch_class **bucket_of(const tw_patch_classes *classes, uint32_t hash) {
  return &classes->buckets[hash & (classes->bucket_count - 1)];
}

static tw_patch_class *find_class(const tw_patch_classes *classes, const tw_neighbourhood *n) {
  for (tw_patch_class *c = *bucket_of(classes, n->hash); c; c = c->next)
    if (c->local.hash == n->hash && c->local.chaikin == n->chaikin && c->local.key_size == n->key_size &&
        c->point_count == n->point_count && memcmp(c->local.quads, n->quads, n->key_size) == 0)
      return c;
  return NULL;
}

static void link_class(tw_patch_classes *classes, tw_patch_class *class) {
  tw_patch_class **bucket = bucket_of(classes, class->local.hash);
  class->next = *bucket;
  *bucket = class;
}

/* Doubles the number of buckets. Without memory the table stays as it is, with longer chains. */
static void add_buckets(tw_patch_classes *classes) {
  uint32_t count = classes->bucket_count;
  tw_patch_class **old = classes->buckets, **buckets = tw_alloc_zero(2 * (size_t)count, sizeof *buckets);
  if (!buckets) return;
  classes->buckets = buckets;
  classes->bucket_count = 2 * count;
  for (uint32_t i = 0; i < count; i++)
    for (tw_patch_class *class = old[i], *next; class; class = next) {
      next = class->next;
      link_class(classes, class);
    }
  tw_free(old);
}

/* Makes the class of a neighbourhood. Its refinement step is made when a depth is asked for. */
static tw_status make_class(tw_patch_classes *classes, const tw_neighbourhood *n, tw_patch_class **out) {
  tw_patch_class *class = tw_arena_alloc(classes->arena, 1, sizeof *class);
  void *key = tw_arena_alloc(classes->arena, 1, n->key_size);
  tw_arena *scratch = tw_arena_create();
  tw_status status = TW_NO_MEMORY;
  if (class && key && scratch) {
    memcpy(key, n->quads, n->key_size);
    class->local = tw_neighbourhood_lay_out(key, n->point_count, n->face_count, n->chaikin);
    class->local.hash = n->hash;
    class->point_count = n->point_count;
    tw_topology topology;
    status = to_topology(&class->local, scratch, &topology);
    if (status == TW_OK) status = make_masks(classes, &topology, class);
  }
  tw_arena_destroy(scratch);
  *out = class;
  return status;
}

static tw_status add_class(tw_patch_classes *classes, const tw_neighbourhood *n, tw_patch_class **out) {
  if (tw_arena_size(classes->arena) > BYTES_MAX) return TW_LIMIT;
  tw_status status = make_class(classes, n, out);
  if (status != TW_OK) return status;
  if (n->point_count > classes->point_max) classes->point_max = n->point_count;
  link_class(classes, *out);
  if (++classes->class_count > classes->bucket_count) add_buckets(classes);
  return TW_OK;
}

tw_status tw_patch_classify(tw_patch_classes *classes, tw_collector *collector, uint32_t corner,
                            uint32_t depth, tw_patch_class **out, const uint32_t **points) {
  const tw_neighbourhood *found = tw_collector_find(collector, corner, points);
  if (!found || classes->failed) return TW_LIMIT;
  tw_patch_class *class = find_class(classes, found);
  tw_status status = class ? TW_OK : add_class(classes, found, &class);
  if (status == TW_OK) status = deepen(classes, class, depth);
  classes->failed = status != TW_OK;
  *out = class;
  return status;
}
