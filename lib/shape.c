/* Finds what surrounds a quad: 16 control points where it is regular, else a class that all quads of
 * the same surroundings share. Classes are keyed by their connectivity and sharpness. */
#include "shape.h"

#include <stdlib.h>
#include <string.h>

#include "block.h"
#include "common_shape.h"

enum {
  POINTS_MAX = 1024, /* of one neighbourhood: a pole of about 500 faces */
  BUCKETS_FIRST = 16,
  BYTES_MAX = 64 << 20 /* all classes together */
};

struct tw_patch_shapes {
  tw_arena *arena, *stencils;
  tw_patch_class **buckets; /* [bucket_count], a power of two */
  uint32_t bucket_count, class_count;
  uint32_t point_max, refined_max; /* of any class */
  uint32_t depth_max;
  tw_patch_class *commons;
  bool original; /* copies none */
  bool failed;   /* a class may be half made: no more of them */
};

struct tw_collector {
  const tw_topology *topology;
  uint32_t *vertex_marks; /* [vertex_count], all zero between calls */
  uint8_t *face_marks;    /* [face_count], likewise */
  bool chaikin;
  /* The neighbourhood that is being collected. */
  uint32_t points[POINTS_MAX];
  uint32_t face_begins[POINTS_MAX]; /* first corner of each face */
  uint32_t point_count, face_count;
  tw_neighbourhood found;
  uint32_t key[POINTS_MAX * 10 + 4]; /* of `found` */
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
  free(shapes->buckets);
  free(shapes);
}

size_t tw_patch_shapes_size(const tw_patch_shapes *shapes) {
  return sizeof *shapes + tw_arena_size(shapes->arena) + tw_arena_size(shapes->stencils) +
         shapes->bucket_count * sizeof(tw_patch_class *);
}

tw_arena *tw_patch_shapes_stencils(tw_patch_shapes *shapes) {
  return shapes->stencils;
}

tw_collector *tw_collector_create(const tw_topology *topology, bool chaikin) {
  tw_collector *c = tw_block_alloc(1, sizeof *c);
  if (!c) return NULL;
  c->topology = topology;
  c->chaikin = chaikin;
  c->vertex_marks = tw_block_alloc_zero(topology->vertex_count, sizeof *c->vertex_marks);
  c->face_marks = tw_block_alloc_zero(topology->face_count, 1);
  if (c->vertex_marks && c->face_marks) return c;
  tw_collector_destroy(c);
  return NULL;
}

void tw_collector_destroy(tw_collector *collector) {
  if (!collector) return;
  tw_block_free(collector->vertex_marks);
  tw_block_free(collector->face_marks);
  tw_block_free(collector);
}

tw_patch_class *tw_patch_shapes_commons(const tw_patch_shapes *shapes) {
  return shapes->commons;
}

uint32_t tw_patch_shapes_scratch(const tw_patch_shapes *shapes) {
  /* Each depth keeps the points of its shape and the rows refined from them. */
  return (shapes->refined_max + shapes->point_max) * (shapes->depth_max + 1);
}

/* ---- regular quads -------------------------------------------------------------------------- */

static bool side_is_sharp(const tw_topology *t, uint32_t corner) {
  return tw_is_infinite(t->edge_sharpness[t->corner_edge[corner]]);
}

/* Number of infinitely sharp edges at a vertex; UINT32_MAX when one is semi-sharp. */
static uint32_t sharp_edges(const tw_topology *t, uint32_t vertex) {
  uint32_t count = 0;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++) {
    float sharpness = t->edge_sharpness[t->ring_edges[i]];
    if (tw_is_semi_sharp(sharpness)) return UINT32_MAX;
    count += sharpness > 0;
  }
  return count;
}

uint8_t tw_vertex_smooth_faces(const tw_topology *topology, uint32_t vertex) {
  const tw_topology *t = topology;
  uint32_t faces = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex];
  if (faces < 3 || faces > TW_SMOOTH_FACES_MAX) return 0;
  bool smooth = t->smooth || (t->vertex_flags[vertex] == 0 && !(t->vertex_sharpness[vertex] > 0) &&
                              sharp_edges(t, vertex) == 0);
  return smooth ? (uint8_t)faces : 0;
}

static bool corner_is_regular(const tw_topology *t, uint32_t corner) {
  uint32_t vertex = t->corner_vertex[corner], before = tw_quad_previous(corner);
  bool leading = side_is_sharp(t, corner), trailing = side_is_sharp(t, before);
  float sharpness = t->vertex_sharpness[vertex];
  uint32_t sharp = sharp_edges(t, vertex);
  if (leading && trailing) return tw_is_infinite(sharpness) || (sharp > 2 && sharp != UINT32_MAX);
  if (sharpness > 0) return false;
  if (!leading && !trailing)
    return sharp == 0 && !(t->vertex_flags[vertex] & (TW_VERTEX_BORDER | TW_VERTEX_NONMANIFOLD)) &&
           t->fan_offsets[vertex + 1] - t->fan_offsets[vertex] == 4;
  if (sharp != 2) return false;
  /* Two faces on this side of the crease: beyond the smooth side's neighbour comes the crease again. */
  if (trailing) return side_is_sharp(t, tw_quad_next(t->sibling[corner]));
  return side_is_sharp(t, tw_quad_previous(t->sibling[before]));
}

/* Place of the grid's (x, y), -1 to 2, in the frame that begins at `turn`. */
static uint32_t turned(uint32_t turn, int x, int y) {
  for (; turn > 0; turn--) {
    int old = x;
    x = 1 - y;
    y = old;
  }
  return (uint32_t)((y + 1) * 4 + x + 1);
}

/* Which sides are sharp; false when a corner is not regular. smooth_faces: as for tw_patch_regular. */
static bool find_sharp_sides(const tw_topology *t, const uint32_t corners[4], const uint8_t *smooth_faces,
                             uint8_t *sharp) {
  *sharp = 0;
  for (uint32_t s = 0; s < 4; s++) {
    /* Nor is an edge at such a corner sharp. */
    if (smooth_faces && smooth_faces[t->corner_vertex[corners[s]]] == 4) continue;
    if (!corner_is_regular(t, corners[s])) return false;
    if (side_is_sharp(t, corners[s])) *sharp |= (uint8_t)(1u << s);
  }
  return true;
}

bool tw_patch_regular(const tw_topology *topology, uint32_t corner, const uint8_t *smooth_faces,
                      uint32_t points[16], uint8_t *reflected) {
  const tw_topology *t = topology;
  uint32_t corners[4] = {corner, tw_quad_next(corner), tw_quad_next(tw_quad_next(corner)),
                         tw_quad_previous(corner)};
  uint8_t sharp;
  if (!find_sharp_sides(t, corners, smooth_faces, &sharp)) return false;
  for (int i = 0; sharp && i < 16; i++) points[i] = t->corner_vertex[corner];
  for (uint32_t s = 0; s < 4; s++) {
    points[turned(s, 0, 0)] = t->corner_vertex[corners[s]];
    if (sharp >> s & 1) continue;
    /* The quad across side s, from its corner at the far end of the side. */
    uint32_t across = t->sibling[corners[s]], near = tw_quad_next(across);
    points[turned(s, 0, -1)] = t->corner_vertex[tw_quad_next(near)];
    points[turned(s, 1, -1)] = t->corner_vertex[tw_quad_previous(across)];
    if (sharp >> ((s + 3) & 3) & 1) continue;
    /* The quad at corner s alone. */
    uint32_t diagonal = tw_quad_next(t->sibling[near]);
    points[turned(s, -1, -1)] = t->corner_vertex[tw_quad_next(tw_quad_next(diagonal))];
  }
  *reflected = sharp;
  return true;
}

/* ---- smooth quads --------------------------------------------------------------------------- */

/* The corner at the same vertex in the next face of its fan. */
static uint32_t next_in_fan(const tw_topology *t, uint32_t corner) {
  return t->sibling[tw_quad_previous(corner)];
}

/* Adds what `count` further faces of a corner's fan bring: each the point across, and all but the last the
 * far end of the edge to the next face. */
static uint32_t *add_fan(const tw_topology *t, uint32_t corner, uint32_t count, uint32_t *out) {
  for (uint32_t i = 0; i < count; i++) {
    uint32_t previous = tw_quad_previous(corner);
    *out++ = t->corner_vertex[tw_quad_previous(previous)];
    if (i + 1 < count) *out++ = t->corner_vertex[previous];
    corner = t->sibling[previous];
  }
  return out;
}

uint32_t tw_patch_smooth_points(const tw_topology *topology, uint32_t corner, const uint8_t *smooth_faces,
                                uint32_t *points) {
  const tw_topology *t = topology;
  uint32_t corners[4] = {corner, tw_quad_next(corner), tw_quad_next(tw_quad_next(corner)),
                         tw_quad_previous(corner)};
  uint32_t faces[4], *end = points + 4;
  for (uint32_t k = 0; k < 4; k++) {
    points[k] = t->corner_vertex[corners[k]];
    faces[k] = smooth_faces[points[k]];
  }
  end = add_fan(t, next_in_fan(t, corners[0]), faces[0] - 1, end);
  /* The faces across the sides of the quad have been added with the corner before, or with corner 0. */
  end = add_fan(t, next_in_fan(t, next_in_fan(t, corners[1])), faces[1] - 2, end);
  end = add_fan(t, next_in_fan(t, next_in_fan(t, corners[2])), faces[2] - 2, end);
  if (faces[3] == 3)
    return (uint32_t)(end - points) - 1; /* those across its two sides have a point in common */
  end = add_fan(t, next_in_fan(t, next_in_fan(t, corners[3])), faces[3] - 3, end);
  return (uint32_t)(end - points);
}

/* ---- collecting a neighbourhood ------------------------------------------------------------- */

static bool collect_point(tw_collector *c, uint32_t vertex) {
  if (c->vertex_marks[vertex]) return true;
  if (c->point_count == POINTS_MAX) return false;
  c->points[c->point_count++] = vertex;
  c->vertex_marks[vertex] = c->point_count;
  return true;
}

static bool collect_face(tw_collector *c, uint32_t begin) {
  if (c->face_marks[begin / 4]) return true;
  if (c->face_count == POINTS_MAX) return false;
  c->face_marks[begin / 4] = 1;
  c->face_begins[c->face_count++] = begin;
  for (uint32_t i = 0, corner = begin; i < 4; i++, corner = tw_quad_next(corner))
    if (!collect_point(c, c->topology->corner_vertex[corner])) return false;
  return true;
}

/* Fills points and face_begins; false when there are too many. */
static bool collect(tw_collector *c, uint32_t corner) {
  const tw_topology *t = c->topology;
  c->point_count = c->face_count = 0;
  bool fits = collect_face(c, corner);
  for (uint32_t k = 0, own = corner; k < 4 && fits; k++, own = tw_quad_next(own)) {
    uint32_t vertex = t->corner_vertex[own];
    const uint32_t *fan = t->fan_corners + t->fan_offsets[vertex];
    uint32_t count = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex], place = 0;
    while (fan[place] != own) place++;
    for (uint32_t i = 1; i < count && fits; i++) fits = collect_face(c, fan[(place + i) % count]);
  }
  return fits;
}

static void unmark(tw_collector *c) {
  for (uint32_t i = 0; i < c->point_count; i++) c->vertex_marks[c->points[i]] = 0;
  for (uint32_t i = 0; i < c->face_count; i++) c->face_marks[c->face_begins[i] / 4] = 0;
}

/* Bytes of the key of a neighbourhood. */
static size_t key_size(uint32_t points, uint32_t faces, bool chaikin) {
  size_t size = faces * (sizeof(uint32_t[4]) + sizeof(float[4])) + sizeof(float[4]);
  return chaikin ? size + points * (sizeof(float) + sizeof(uint32_t)) : size;
}

/* Lays the arrays of a neighbourhood out over `key`, which has key_size bytes. */
static tw_neighbourhood lay_out(void *key, uint32_t points, uint32_t faces, bool chaikin) {
  tw_neighbourhood n = {.point_count = points,
                        .face_count = faces,
                        .chaikin = chaikin,
                        .key_size = key_size(points, faces, chaikin)};
  n.quads = key;
  n.sharpness = (float(*)[4])(void *)(n.quads + faces);
  n.vertex_sharpness = (float *)(n.sharpness + faces);
  if (chaikin) {
    n.semi_sum = n.vertex_sharpness + 4;
    n.semi_count = (uint32_t *)(void *)(n.semi_sum + points);
  }
  return n;
}

static uint32_t hash_bytes(const void *bytes, size_t size) {
  const uint32_t *words = bytes; /* keys are made of 32-bit words */
  uint32_t hash = 2166136261u;
  for (size_t i = 0; i < size / sizeof *words; i++) hash = (hash ^ words[i]) * 16777619u;
  return hash ^ hash >> 15;
}

static void note_semi_end(tw_neighbourhood *n, const tw_topology *t, uint32_t local, uint32_t vertex) {
  if (!n->semi_sum) return;
  n->semi_sum[local] = t->semi_sum[vertex];
  n->semi_count[local] = t->semi_count[vertex];
}

/* Writes the key of the collected neighbourhood into the buffer that is kept for it. */
static void describe(tw_collector *collector) {
  const tw_topology *t = collector->topology;
  tw_neighbourhood *n = &collector->found;
  *n = lay_out(collector->key, collector->point_count, collector->face_count, collector->chaikin);
  memset(collector->key, 0, n->key_size);
  for (uint32_t f = 0; f < n->face_count; f++) {
    for (uint32_t i = 0, c = collector->face_begins[f]; i < 4; i++, c = tw_quad_next(c))
      n->quads[f][i] = collector->vertex_marks[t->corner_vertex[c]] - 1;
    for (uint32_t i = 0, c = collector->face_begins[f]; i < 4; i++, c = tw_quad_next(c)) {
      uint32_t from = n->quads[f][i], to = n->quads[f][(i + 1) % 4];
      if (from > 3 && to > 3) continue;
      float sharpness = t->edge_sharpness[t->corner_edge[c]];
      n->sharpness[f][i] = sharpness;
      if (!tw_is_semi_sharp(sharpness)) continue;
      note_semi_end(n, t, from, collector->points[from]);
      note_semi_end(n, t, to, collector->points[to]);
    }
  }
  for (uint32_t k = 0; k < 4; k++) n->vertex_sharpness[k] = t->vertex_sharpness[collector->points[k]];
  n->hash = hash_bytes(n->quads, n->key_size) ^ n->point_count;
}

/* ---- making a class ------------------------------------------------------------------------- */

/* The neighbourhood as a mesh of its own. Its outer rim looks like a border, but nothing asks for
 * points there. */
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
  for (uint32_t k = 0; k < 4; k++) {
    uint32_t capacity = tw_limit_capacity(t, k);
    tw_limit_entry *entries = tw_arena_alloc(shapes->arena, capacity, sizeof *entries);
    if (!entries) return TW_NO_MEMORY;
    shape->mask_counts[k] = tw_limit_mask(t, false, k, entries);
    shape->masks[k] = entries;
    shape->framed[k] = tw_limit_frame(t, false, k, shape->frames[k]);
  }
  return TW_OK;
}

/* What refining a neighbourhood needs while it lasts. */
typedef struct step {
  tw_arena *arena;
  tw_topology parent, child;
  tw_collector *collector; /* of the child */
  float *matrix;           /* [child vertices][parent points] */
  uint32_t *new_index;     /* [child vertices], 1 + row in the class, 0 when unused */
  uint32_t *rows;          /* [child vertices], used ones in the order of their rows */
  uint32_t row_count;
} step;

static tw_status start_step(const tw_neighbourhood *local, step *s) {
  const tw_rules rules = {.chaikin = local->chaikin};
  tw_status status = to_topology(local, s->arena, &s->parent);
  if (status == TW_OK) status = tw_refine_topology(&s->parent, &rules, s->arena, NULL, &s->child);
  if (status != TW_OK) return status;
  uint32_t width = local->point_count, children = s->child.vertex_count;
  float *identity = tw_arena_alloc(s->arena, (size_t)width * width, sizeof *identity);
  s->matrix = tw_arena_alloc(s->arena, (size_t)children * width, sizeof *s->matrix);
  s->new_index = tw_arena_alloc(s->arena, children, sizeof *s->new_index);
  s->rows = tw_arena_alloc(s->arena, children, sizeof *s->rows);
  s->collector = tw_collector_create(&s->child, local->chaikin);
  if (!identity || !s->matrix || !s->new_index || !s->rows || !s->collector) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < width; i++) identity[(size_t)i * width + i] = 1;
  tw_refine_values(&s->parent, &rules, width, identity, NULL, s->matrix);
  return TW_OK;
}

/* Rows of the class for these child vertices, adding those that are new. */
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
  /* Child quad k begins at parent corner k; begun (4 - k) corners later it lies as its parent does. */
  uint32_t corner = 4 * k + (4 - k) % 4;
  uint32_t regular[16];
  const uint32_t *vertices = regular;
  uint32_t count = 16;
  if (!tw_patch_regular(&s->child, corner, NULL, regular, &part->reflected)) {
    tw_status status = tw_patch_classify(shapes, s->collector, corner, depth, &part->shape, &vertices);
    if (status != TW_OK) return status;
    count = part->shape->point_count;
  }
  part->points = take_rows(shapes, s, vertices, count);
  return part->points ? TW_OK : TW_NO_MEMORY;
}

/* Sparse rows from the dense matrix. */
static tw_status store_rows(tw_patch_shapes *shapes, const step *s, tw_patch_class *shape) {
  uint32_t width = shape->point_count, entries = 0;
  for (uint32_t r = 0; r < s->row_count; r++)
    for (uint32_t i = 0; i < width; i++) entries += s->matrix[(size_t)s->rows[r] * width + i] != 0;
  uint32_t *offsets = tw_arena_alloc(shapes->arena, s->row_count + 1, sizeof *offsets);
  uint32_t *columns = tw_arena_alloc(shapes->arena, entries, sizeof *columns);
  float *weights = tw_arena_alloc(shapes->arena, entries, sizeof *weights);
  if (!offsets || !columns || !weights) return TW_NO_MEMORY;
  uint32_t place = 0;
  for (uint32_t r = 0; r < s->row_count; r++) {
    const float *row = s->matrix + (size_t)s->rows[r] * width;
    for (uint32_t i = 0; i < width; i++) {
      if (row[i] == 0) continue;
      columns[place] = i;
      weights[place++] = row[i];
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

/* Makes a class good for `depth` steps. Depth is bounded by TW_LEVEL_MAX, and so is the recursion. */
static tw_status deepen(tw_patch_shapes *shapes, tw_patch_class *shape, uint32_t depth) {
  if (depth > shapes->depth_max) shapes->depth_max = depth;
  if (shape->depth >= depth) return TW_OK;
  shape->depth = depth; /* set first: a class is often its own quarter */
  if (!shape->row_offsets) return refine_class(shapes, shape, depth);
  for (uint32_t k = 0; k < 4; k++) {
    if (!shape->parts[k].shape) continue;
    tw_status status = deepen(shapes, shape->parts[k].shape, depth - 1);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

/* Where the chain of a hash begins. */
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

/* Doubles the buckets; without memory chains get longer. */
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
  free(old);
}

/* A class of its own for a neighbourhood; its refinement comes when a depth is asked for. */
static tw_status make_class(tw_patch_shapes *shapes, const tw_neighbourhood *n, tw_patch_class **out) {
  tw_patch_class *shape = tw_arena_alloc(shapes->arena, 1, sizeof *shape);
  void *key = tw_arena_alloc(shapes->arena, 1, n->key_size);
  tw_arena *scratch = tw_arena_create();
  tw_status status = TW_NO_MEMORY;
  if (shape && key && scratch) {
    memcpy(key, n->quads, n->key_size);
    shape->local = lay_out(key, n->point_count, n->face_count, n->chaikin);
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

/* What is counted and looked up is the copy's own, all else the common class's. */
static tw_status copy_class(tw_patch_shapes *shapes, tw_common_shape *common, tw_patch_class **out) {
  tw_patch_class *shape = tw_arena_alloc(shapes->arena, 1, sizeof *shape);
  if (!shape) return TW_NO_MEMORY;
  *shape = *tw_common_class(common);
  shape->common = common;
  shape->next_common = shapes->commons;
  shapes->commons = shape;
  for (uint32_t k = 0; k < 4; k++)
    if (shape->parts[k].shape) shape->parts[k].shape = shape;
  if (shape->refined_count > shapes->refined_max) shapes->refined_max = shape->refined_count;
  *out = shape;
  return TW_OK;
}

static tw_status add_class(tw_patch_shapes *shapes, const tw_neighbourhood *n, tw_patch_class **out) {
  if (tw_arena_size(shapes->arena) > BYTES_MAX) return TW_LIMIT;
  tw_common_shape *common = NULL;
  tw_status status = shapes->original ? TW_OK : tw_common_find(n, &common);
  if (status == TW_OK) status = common ? copy_class(shapes, common, out) : make_class(shapes, n, out);
  if (status != TW_OK) return status;
  if (n->point_count > shapes->point_max) shapes->point_max = n->point_count;
  link_class(shapes, *out);
  if (++shapes->class_count > shapes->bucket_count) add_buckets(shapes);
  return TW_OK;
}

tw_status tw_patch_shapes_of(const tw_neighbourhood *neighbourhood, tw_patch_shapes **shapes,
                             tw_patch_class **out) {
  *shapes = tw_patch_shapes_create();
  if (!*shapes) return TW_NO_MEMORY;
  (*shapes)->original = true;
  tw_status status = add_class(*shapes, neighbourhood, out);
  if (status == TW_OK) status = deepen(*shapes, *out, TW_LEVEL_MAX);
  if (status == TW_OK) return TW_OK;
  tw_patch_shapes_destroy(*shapes);
  *shapes = NULL;
  return status;
}

tw_status tw_patch_classify(tw_patch_shapes *shapes, tw_collector *collector, uint32_t corner, uint32_t depth,
                            tw_patch_class **out, const uint32_t **points) {
  bool fits = collect(collector, corner);
  if (fits) describe(collector);
  unmark(collector);
  if (!fits || shapes->failed) return TW_LIMIT;
  tw_patch_class *shape = find_class(shapes, &collector->found);
  tw_status status = shape ? TW_OK : add_class(shapes, &collector->found, &shape);
  if (status == TW_OK) status = deepen(shapes, shape, depth);
  shapes->failed = status != TW_OK;
  *out = shape;
  *points = collector->points;
  return status;
}
