/* Faces are read in runs, each with the face before it and the face after it, which FB_ngon_encoding
 * needs. */
#include "triangulator.h"

#include <stdlib.h>

enum { FACES_SCRATCH = 1024 };

bool tw_triangulator_init(tw_triangulator *triangles, const tw_surface *const *surfaces, uint32_t count,
                          tw_polygons polygons, tw_surface_reader *reader) {
  *triangles = (tw_triangulator){.reader = reader,
                                 .polygons = polygons,
                                 .domain = TW_DOMAIN_VERTICES,
                                 .corner_capacity = (size_t)4 * FACES_SCRATCH};
  for (uint32_t i = 0; i < count; i++) {
    size_t three = 3 * tw_surface_largest_face(surfaces[i]);
    if (three > triangles->corner_capacity) triangles->corner_capacity = three;
  }
  triangles->corners = tw_alloc(triangles->corner_capacity, sizeof *triangles->corners);
  triangles->sizes = tw_alloc(FACES_SCRATCH, sizeof *triangles->sizes);
  triangles->cuts = tw_alloc(FACES_SCRATCH, sizeof *triangles->cuts);
  return triangles->corners && triangles->sizes && triangles->cuts;
}

void tw_triangulator_deinit(tw_triangulator *triangles) {
  tw_free(triangles->corners);
  tw_free(triangles->sizes);
  tw_free(triangles->cuts);
}

tw_surface_group tw_take_material(const tw_surface *surface, uint32_t *i) {
  tw_surface_group faces = *tw_surface_get_group(surface, *i);
  while (++*i < tw_surface_group_count(surface)) {
    const tw_surface_group *next = tw_surface_get_group(surface, *i);
    if (next->material != faces.material) break;
    faces.face_count += next->face_count;
    faces.corner_count += next->corner_count;
  }
  return faces;
}

uint64_t tw_count_triangles(const tw_surface_group *faces) {
  return faces->corner_count - 2 * faces->face_count;
}

/* Faces [face, stop) of a group. The corners and sizes that were read begin with the face before
 * (`lead` is 1) where the group has one, and end with the one after. */
typedef struct face_run {
  uint64_t face, stop;
  uint32_t lead;
  bool has_next;
} face_run;

uint64_t tw_triangles_before(const tw_surface *surface, uint64_t face) {
  return tw_surface_corners_before(surface, face) - 2 * face;
}

uint64_t tw_face_of_triangle(const tw_surface *surface, uint64_t triangle) {
  uint64_t low = 0, high = tw_surface_get_counts(surface)->faces;
  while (high - low > 1) {
    uint64_t middle = low + (high - low) / 2;
    if (tw_triangles_before(surface, middle) <= triangle)
      low = middle;
    else
      high = middle;
  }
  return low;
}

/* Reads up to `wanted` faces, at least one: fewer where their corners would not fit. */
static face_run read_run(tw_triangulator *t, const tw_surface *surface, const tw_surface_group *group,
                         uint64_t face, uint64_t wanted) {
  uint64_t end = group->first_face + group->face_count;
  face_run run = {.face = face, .lead = face > group->first_face};
  uint64_t most = end - face < FACES_SCRATCH - 2 ? end - face : FACES_SCRATCH - 2;
  uint64_t first = face - run.lead, count = wanted < most ? wanted : most, last, corners;
  do { /* one face and its neighbours always fit */
    last = face + count < end ? face + count + 1 : end;
    corners = tw_surface_corners_before(surface, last) - tw_surface_corners_before(surface, first);
    run.stop = face + count;
    count = (count + 1) / 2;
  } while (corners > t->corner_capacity);
  run.has_next = last > run.stop;
  tw_surface_read_faces(t->reader, t->domain, first, (size_t)(last - first), t->sizes, t->corners);
  t->cut_count = tw_surface_read_cuts(t->reader, first, (size_t)(last - first), t->cuts);
  return run;
}

static bool is_apart(uint32_t vertex, const uint32_t *previous, const uint32_t *next) {
  return !(previous && vertex == *previous) && !(next && vertex == *next);
}

/* With FB_ngon_encoding neighbours in the group must not start from the same vertex: every second face starts
 * where it likes best, the others take a corner that neither neighbour starts from, which depends on the two
 * neighbours alone. Only a face of two points, gone through several times, may have none: it takes one that
 * the previous face does not start from. */
bool tw_fan_start(const uint32_t *corners, uint32_t size, const tw_face_cut *cut, const uint32_t *previous,
                  const uint32_t *next, uint32_t *start) {
  /* A bent quad keeps the diagonal that write_quads draws, where it can. */
  static const uint32_t quad_starts[] = {0, 2, 1, 3};
  for (uint32_t i = 0; cut && i < cut->fan_count; i++)
    if (is_apart(corners[cut->fans[i]], previous, next)) {
      *start = cut->fans[i];
      return true;
    }
  for (uint32_t i = 0; i < size; i++) {
    *start = size == 4 ? quad_starts[i] : i;
    if (is_apart(corners[*start], previous, next)) return !cut;
  }
  for (*start = 0; *start + 1 < size && !is_apart(corners[*start], previous, NULL);) ++*start;
  return !cut;
}

/* Triangles [from, to) of a face's fan. */
static void write_fan(const uint32_t *corners, uint32_t size, uint32_t start, uint32_t from, uint32_t to,
                      uint32_t *out) {
  for (uint32_t triangle = from; triangle < to; triangle++) {
    uint64_t second = (uint64_t)start + triangle + 1, third = second + 1;
    *out++ = corners[start];
    *out++ = corners[second < size ? second : second - size];
    *out++ = corners[third < size ? third : third - size];
  }
}

static void write_quads(const uint32_t *restrict corners, size_t count, uint32_t *restrict out) {
  for (size_t i = 0; i < count; i++, corners += 4, out += 6) {
    out[0] = corners[0];
    out[1] = corners[1];
    out[2] = corners[2];
    out[3] = corners[0];
    out[4] = corners[2];
    out[5] = corners[3];
  }
}

static size_t count_quads(const uint32_t *sizes, uint64_t most) {
  size_t count = 0;
  while (count < most && sizes[count] == 4) count++;
  return count;
}

/* How a face is written: as a fan, or by the triangles of its cut. */
typedef struct face_shape {
  uint32_t start;
  const tw_face_cut *cut; /* NULL for a fan */
} face_shape;

/* The corner that a triangle of a shape begins with. previous, next: the vertices that the triangles before
 * and after the face begin with; NULL: any may. The first and the last triangle of a cut turn until they
 * begin with another vertex than their neighbours. */
static uint32_t begin_of(const face_shape *shape, const uint32_t *corners, uint32_t triangle,
                         const uint32_t *previous, const uint32_t *next, uint32_t *turn) {
  const tw_face_cut *cut = shape->cut;
  uint32_t last = cut->size - 3, before;
  const uint32_t *own = cut->triangles[triangle];
  *turn = 0;
  if (triangle == 0) {
    const uint32_t *after = last > 0 ? &corners[cut->triangles[1][0]] : next;
    while (*turn < 2 && !is_apart(corners[own[*turn]], previous, after)) ++*turn;
  } else if (triangle == last) {
    uint32_t ignored;
    before = corners[begin_of(shape, corners, triangle - 1, previous, NULL, &ignored)];
    while (*turn < 2 && !is_apart(corners[own[*turn]], &before, next)) ++*turn;
  }
  return own[*turn];
}

/* Writes triangles [from, to) of a face that is cut. */
static void write_cut(const face_shape *shape, const uint32_t *corners, const uint32_t *previous,
                      const uint32_t *next, uint32_t from, uint32_t to, uint32_t *out) {
  for (uint32_t i = from; i < to; i++) {
    uint32_t turn;
    begin_of(shape, corners, i, previous, next, &turn);
    for (uint32_t k = 0; k < 3; k++) *out++ = corners[shape->cut->triangles[i][(turn + k) % 3]];
  }
}

/* The group that faces are read from. */
typedef struct face_source {
  const tw_surface_group *group;
  const tw_face_cut *cuts, *cuts_end; /* those of the run's faces to come */
  bool ngons;
} face_source;

static const tw_face_cut *cut_of(const face_source *source, uint64_t face) {
  const tw_face_cut *cut = source->cuts;
  while (cut < source->cuts_end && cut->face < face) cut++;
  return cut < source->cuts_end && cut->face == face ? cut : NULL;
}

/* The shape of a face that does not depend on its neighbours. */
static face_shape own_shape(const tw_face_cut *cut) {
  if (!cut) return (face_shape){0, NULL};
  if (cut->fan_count > 0) return (face_shape){cut->fans[0], NULL};
  return (face_shape){0, cut};
}

static uint32_t first_vertex(const face_shape *shape, const uint32_t *corners) {
  return corners[shape->cut ? shape->cut->triangles[0][0] : shape->start];
}

/* The vertex that the last triangle of a face begins with, which has its own shape. */
static uint32_t last_vertex(const face_shape *shape, const uint32_t *corners) {
  return corners[shape->cut ? shape->cut->triangles[shape->cut->size - 3][0] : shape->start];
}

static bool is_second(const face_source *source, uint64_t face) {
  return source->ngons && (face - source->group->first_face) % 2 == 1;
}

static face_shape shape_of(const face_source *source, uint64_t face, const uint32_t *corners, uint32_t size,
                           const uint32_t *previous, const uint32_t *next) {
  const tw_face_cut *cut = cut_of(source, face);
  if (!is_second(source, face)) return own_shape(cut);
  face_shape shape = {0, NULL};
  if (!tw_fan_start(corners, size, cut, previous, next, &shape.start)) shape.cut = cut;
  return shape;
}

/* Writes up to `count` triangles of a run, beginning with triangle `from` of its first face. Returns how
 * many. */
static size_t write_run(const tw_triangulator *t, face_source *source, face_run run, uint32_t from,
                        size_t count, uint32_t *out) {
  const uint32_t *sizes = t->sizes + run.lead, *corners = t->corners, *previous = NULL;
  source->cuts = t->cuts;
  source->cuts_end = t->cuts + t->cut_count;
  uint32_t before = 0, after = 0;
  if (run.lead) {
    face_shape shape = own_shape(cut_of(source, run.face - 1));
    before = last_vertex(&shape, corners);
    previous = &before;
    corners += t->sizes[0];
  }
  size_t done = 0;
  for (uint64_t face = run.face; face < run.stop && done < count;) {
    while (source->cuts < source->cuts_end && source->cuts->face < face) source->cuts++;
    uint64_t stop = source->cuts < source->cuts_end ? tw_least(run.stop, source->cuts->face) : run.stop;
    size_t left = count - done; /* triangles */
    size_t quads = source->ngons || from > 0 ? 0 : count_quads(sizes, tw_least(stop - face, left / 2));
    if (quads > 0) { /* nearly always all faces; `previous` is for n-gons only */
      write_quads(corners, quads, out + 3 * done);
      done += 2 * quads;
      face += quads;
      sizes += quads;
      corners += 4 * quads;
      continue;
    }
    uint32_t size = *sizes++;
    const uint32_t *next = NULL;
    bool is_between = is_second(source, face);
    if (is_between && (face + 1 < run.stop || run.has_next)) {
      face_shape shape = own_shape(cut_of(source, face + 1));
      after = first_vertex(&shape, corners + size);
      next = &after;
    }
    face_shape shape = shape_of(source, face, corners, size, previous, next);
    uint32_t to = (uint32_t)tw_least(size - 2, from + left);
    if (shape.cut)
      write_cut(&shape, corners, is_between ? previous : NULL, next, from, to, out + 3 * done);
    else
      write_fan(corners, size, shape.start, from, to, out + 3 * done);
    done += to - from;
    from = 0;
    face++;
    before = is_between ? 0 : last_vertex(&shape, corners);
    previous = &before;
    corners += size;
  }
  return done;
}

void tw_triangulator_read(tw_triangulator *triangles, const tw_surface *surface,
                          const tw_surface_group *faces, uint64_t first, size_t count, uint32_t *out) {
  tw_surface_reader_turn(triangles->reader, surface, 0, 0);
  uint64_t triangle = tw_triangles_before(surface, faces->first_face) + first,
           face = tw_face_of_triangle(surface, triangle);
  uint32_t from = (uint32_t)(triangle - tw_triangles_before(surface, face));
  face_source source = {.group = faces, .ngons = triangles->polygons == TW_POLYGONS_NGON};
  while (count > 0) {
    face_run run = read_run(triangles, surface, faces, face, (from + (uint64_t)count + 1) / 2);
    size_t done = write_run(triangles, &source, run, from, count, out);
    out += 3 * done;
    count -= done;
    face = run.stop;
    from = 0;
  }
}
