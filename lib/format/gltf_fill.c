/* The bytes of a plan's views: rows as the surface makes them, straight into the answer; faces as
 * triangles. A polygon becomes a fan from one of its corners. */
#include "gltf_fill.h"

#include <stdlib.h>
#include <string.h>

#include "largest_face.h"

enum { ROWS_SCRATCH = 4096, FACES_SCRATCH = 1024 };

static uint64_t least(uint64_t a, uint64_t b) {
  return a < b ? a : b;
}

struct tw_gltf_filler {
  const tw_scene *scene;
  tw_surface_reader *reader; /* turned to the surface of the view */
  float *rows;               /* [ROWS_SCRATCH], for rows that are converted */
  size_t corner_capacity;
  uint32_t *corners;             /* [corner_capacity]: three of the largest faces fit */
  uint32_t *triangles;           /* [corner_capacity][3], before they are narrowed to 16 bits */
  uint32_t sizes[FACES_SCRATCH]; /* of the faces in corners */
};

/* ---- rows ------------------------------------------------------------------------------------- */

/* Joints as unsigned shorts, 0 where the weight is 0, as the validator wants it. */
static void convert_joints(const float *joints, const float *weights, uint8_t *out) {
  uint16_t converted[4];
  for (int i = 0; i < 4; i++) converted[i] = weights[i] > 0 ? (uint16_t)joints[i] : 0;
  memcpy(out, converted, sizeof converted);
}

/* The view's columns of one row. */
static void convert_row(const tw_surface_layout *layout, const tw_gltf_view *view, const float *row,
                        uint8_t *out) {
  uint32_t first = view->first_column, last = first + view->column_count, joints = layout->joints;
  if (joints < first || joints >= last) {
    memcpy(out, row + first, view->element_size);
    return;
  }
  size_t before = (joints - first) * sizeof(float);
  memcpy(out, row + first, before);
  convert_joints(row + joints, row + layout->weights, out + before);
  memcpy(out + before + 4 * sizeof(uint16_t), row + joints + 4, (last - joints - 4) * sizeof(float));
}

static void fill_rows(tw_gltf_filler *filler, const tw_gltf_view *view, uint64_t first, size_t count,
                      uint8_t *out) {
  const tw_surface_layout *layout = tw_surface_get_layout(filler->scene->surfaces[view->mesh]);
  if (view->element_size == layout->stride * sizeof(float)) { /* all columns as they are */
    tw_surface_read_rows(filler->reader, TW_DOMAIN_VERTICES, first, count, (float *)(void *)out);
    return;
  }
  size_t batch = ROWS_SCRATCH / layout->stride;
  for (size_t done = 0; done < count; done += batch) {
    size_t part = count - done < batch ? count - done : batch;
    tw_surface_read_rows(filler->reader, TW_DOMAIN_VERTICES, first + done, part, filler->rows);
    for (size_t i = 0; i < part; i++)
      convert_row(layout, view, filler->rows + i * layout->stride, out + (done + i) * view->element_size);
  }
}

/* ---- triangles -------------------------------------------------------------------------------- */

/* Faces [face, stop) of a group. Corners and sizes in the filler's scratch begin with the face before
 * (`lead` is 1) where the group has one, and end with the one after. */
typedef struct face_run {
  uint64_t face, stop;
  uint32_t lead;
  bool has_next;
} face_run;

static uint64_t triangles_before(const tw_surface *surface, const tw_surface_group *group, uint64_t face) {
  return tw_surface_corners_before(surface, face) - group->first_corner - 2 * (face - group->first_face);
}

/* The group's face that a triangle belongs to. */
static uint64_t find_face(const tw_surface *surface, const tw_surface_group *group, uint64_t triangle) {
  uint64_t low = group->first_face, high = low + group->face_count;
  while (high - low > 1) {
    uint64_t middle = low + (high - low) / 2;
    if (triangles_before(surface, group, middle) <= triangle)
      low = middle;
    else
      high = middle;
  }
  return low;
}

/* Reads up to `wanted` faces, at least one: fewer where their corners would not fit. */
static face_run read_run(tw_gltf_filler *filler, const tw_gltf_view *view, const tw_surface_group *group,
                         uint64_t face, uint64_t wanted) {
  const tw_surface *surface = filler->scene->surfaces[view->mesh];
  uint64_t end = group->first_face + group->face_count;
  face_run run = {.face = face, .lead = face > group->first_face};
  uint64_t most = end - face < FACES_SCRATCH - 2 ? end - face : FACES_SCRATCH - 2;
  uint64_t first = face - run.lead, count = wanted < most ? wanted : most, last, corners;
  do { /* one face and its neighbours always fit */
    last = face + count < end ? face + count + 1 : end;
    corners = tw_surface_corners_before(surface, last) - tw_surface_corners_before(surface, first);
    run.stop = face + count;
    count = (count + 1) / 2;
  } while (corners > filler->corner_capacity);
  run.has_next = last > run.stop;
  tw_surface_read_faces(filler->reader, TW_DOMAIN_VERTICES, first, (size_t)(last - first), filler->sizes,
                        filler->corners);
  return run;
}

/* The corner that a face's fan starts from. With FB_ngon_encoding neighbours in the group must not start
 * from the same vertex: every second face keeps its first corner, the others take the first corner
 * that neither neighbour starts from. Any face has three, so there is one, and it can be told from
 * the neighbours alone. `next` NULL: none; previous likewise. */
static uint32_t fan_start(const uint32_t *corners, const uint32_t *previous, const uint32_t *next) {
  uint32_t start = 0;
  while ((previous && corners[start] == *previous) || (next && corners[start] == *next)) start++;
  return start;
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

/* Up to `count` triangles of a run, from the given one of its first face. Returns how many. */
static size_t write_run(const tw_gltf_filler *filler, const tw_surface_group *group, face_run run,
                        uint32_t from, size_t count, uint32_t *out) {
  bool ngons = filler->scene->polygons == TW_POLYGONS_NGON;
  const uint32_t *sizes = filler->sizes + run.lead, *corners = filler->corners, *previous = NULL;
  if (run.lead) {
    previous = corners;
    corners += filler->sizes[0];
  }
  size_t done = 0;
  for (uint64_t face = run.face; face < run.stop && done < count;) {
    size_t left = count - done; /* triangles */
    size_t quads = ngons || from > 0 ? 0 : count_quads(sizes, least(run.stop - face, left / 2));
    if (quads > 0) { /* nearly always all of them; only ngons ask for the previous face */
      write_quads(corners, quads, out + 3 * done);
      done += 2 * quads;
      face += quads;
      sizes += quads;
      corners += 4 * quads;
      continue;
    }
    uint32_t size = *sizes++, start = 0;
    if (ngons && (face - group->first_face) % 2 == 1)
      start = fan_start(corners, previous, face + 1 < run.stop || run.has_next ? corners + size : NULL);
    uint32_t to = (uint32_t)least(size - 2, from + left);
    write_fan(corners, size, start, from, to, out + 3 * done);
    done += to - from;
    from = 0;
    face++;
    previous = corners;
    corners += size;
  }
  return done;
}

static void narrow(const uint32_t *indices, size_t count, uint16_t *out) {
  for (size_t i = 0; i < count; i++) out[i] = (uint16_t)indices[i];
}

static void fill_triangles(tw_gltf_filler *filler, const tw_gltf_view *view, uint64_t first, size_t count,
                           uint8_t *out) {
  const tw_surface *surface = filler->scene->surfaces[view->mesh];
  const tw_surface_group *group = &view->faces;
  bool wide = view->element_size == 3 * sizeof(uint32_t);
  uint64_t face = find_face(surface, group, first);
  uint32_t from = (uint32_t)(first - triangles_before(surface, group, face));
  while (count > 0) {
    face_run run = read_run(filler, view, group, face, (from + (uint64_t)count + 1) / 2);
    size_t done =
        write_run(filler, group, run, from, count, wide ? (uint32_t *)(void *)out : filler->triangles);
    if (!wide) narrow(filler->triangles, 3 * done, (uint16_t *)(void *)out);
    out += done * view->element_size;
    count -= done;
    face = run.stop;
    from = 0;
  }
}

/* ---- the filler ------------------------------------------------------------------------------- */

void tw_gltf_fill(tw_gltf_filler *filler, const tw_gltf_view *view, uint64_t first, size_t count, void *out) {
  if (view->source != TW_GLTF_MEMORY)
    tw_surface_reader_turn(filler->reader, filler->scene->surfaces[view->mesh]);
  switch (view->source) {
  case TW_GLTF_MEMORY: memcpy(out, (const uint8_t *)view->memory + first, count); return;
  case TW_GLTF_ROWS: fill_rows(filler, view, first, count, out); return;
  case TW_GLTF_TRIANGLES: fill_triangles(filler, view, first, count, out); return;
  }
}

static bool allocate(tw_gltf_filler *filler, const tw_gltf_plan *plan) {
  const tw_scene *scene = filler->scene;
  filler->corner_capacity = (size_t)4 * FACES_SCRATCH;
  for (uint32_t i = 0; i < plan->mesh_count; i++) {
    uint32_t mesh = plan->meshes[i].source;
    size_t three = 3 * tw_largest_face(scene->surfaces[mesh], &scene->model->meshes[mesh]);
    if (three > filler->corner_capacity) filler->corner_capacity = three;
  }
  filler->rows = tw_alloc(ROWS_SCRATCH, sizeof *filler->rows);
  filler->corners = tw_alloc(filler->corner_capacity, sizeof *filler->corners);
  filler->triangles = tw_alloc(filler->corner_capacity, 3 * sizeof *filler->triangles);
  filler->reader = tw_surface_reader_create_shared(scene->surfaces, scene->model->mesh_count);
  return filler->rows && filler->corners && filler->triangles && filler->reader;
}

tw_gltf_filler *tw_gltf_filler_create(const tw_gltf_plan *plan, const tw_scene *scene) {
  tw_gltf_filler *filler = tw_alloc_zero(1, sizeof *filler);
  if (!filler) return NULL;
  filler->scene = scene;
  if (allocate(filler, plan)) return filler;
  tw_gltf_filler_destroy(filler);
  return NULL;
}

void tw_gltf_filler_destroy(tw_gltf_filler *filler) {
  if (!filler) return;
  tw_surface_reader_destroy(filler->reader);
  free(filler->rows);
  free(filler->corners);
  free(filler->triangles);
  free(filler);
}
