/* glTF answers, pulled: some text, the BIN chunk (raw, or in base64), some text. Each block of the BIN chunk
 * is computed when it is read: rows by the surface, most of them straight into the caller's memory, and faces
 * as triangles. Memory that is too small or unaligned for that is filled from a window on the chunk, where
 * the next reads find what an earlier one computed. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gltf/gltf.h"

enum {
  ROWS_SCRATCH = 4096,
  FACES_SCRATCH = 1024,
  WINDOW_SIZE = 16 * 1024, /* no element is larger */
  DIRECT_SIZE = 4 * 1024,  /* reads of this size bypass the window */
  GROUPS_A_PASS = 4096     /* of base64: 3 bytes, 4 characters each */
};

static uint64_t least(uint64_t a, uint64_t b) {
  return a < b ? a : b;
}

/* Computes elements (rows, triangles, bytes) of views; one stream's own. */
typedef struct filler {
  const tw_scene *scene;
  tw_surface_reader *reader; /* turned to the surface of the view */
  float *rows;               /* [ROWS_SCRATCH], for rows that are converted */
  size_t corner_capacity;
  uint32_t *corners;             /* [corner_capacity]: three of the largest faces fit */
  uint32_t *triangles;           /* [corner_capacity][3], before they are narrowed to 16 bits */
  uint32_t sizes[FACES_SCRATCH]; /* of the faces in corners */
} filler;

/* ---- rows ---------------------------------------------------------------------------------------------- */

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

/* Turns the reader to the view's surface, with the displacements that the view has. Returns the view as
 * columns of such rows. */
static tw_gltf_view turn_to_rows(filler *filler, const tw_gltf_view *view) {
  const tw_surface *surface = filler->scene->surfaces[view->mesh];
  const tw_surface_layout *layout = tw_surface_get_layout(surface);
  uint32_t width = layout->morph_width, base = layout->stride - width * layout->morph_count;
  uint32_t first = view->first_column;
  uint32_t end = first + view->column_count;
  uint32_t targets = end > base ? (end - (first > base ? first : base)) / width : 0;
  tw_surface_reader_turn(filler->reader, surface, first > base ? (first - base) / width : 0, targets);
  tw_gltf_view columns = *view;
  if (first >= base && targets > 0) columns.first_column = tw_surface_reader_layout(filler->reader)->morphs;
  return columns;
}

static void fill_rows(filler *filler, const tw_gltf_view *view, uint64_t first, size_t count, uint8_t *out) {
  const tw_gltf_view columns = turn_to_rows(filler, view);
  const tw_surface_layout *layout = tw_surface_reader_layout(filler->reader);
  if (view->element_size == layout->stride * sizeof(float)) { /* all columns as they are */
    tw_surface_read_rows(filler->reader, TW_DOMAIN_VERTICES, first, count, (float *)(void *)out);
    return;
  }
  size_t batch = ROWS_SCRATCH / layout->stride;
  for (size_t done = 0; done < count; done += batch) {
    size_t part = count - done < batch ? count - done : batch;
    tw_surface_read_rows(filler->reader, TW_DOMAIN_VERTICES, first + done, part, filler->rows);
    for (size_t i = 0; i < part; i++)
      convert_row(layout, &columns, filler->rows + i * layout->stride, out + (done + i) * view->element_size);
  }
}

/* ---- triangles ----------------------------------------------------------------------------------------- */

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
static face_run read_run(filler *filler, const tw_gltf_view *view, const tw_surface_group *group,
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
 * that neither neighbour starts from. A face has at least three corners, so there is one, and
 * it depends on the neighbours alone. previous, next: NULL where there is no neighbour. */
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
static size_t write_run(const filler *filler, const tw_surface_group *group, face_run run, uint32_t from,
                        size_t count, uint32_t *out) {
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

static void fill_triangles(filler *filler, const tw_gltf_view *view, uint64_t first, size_t count,
                           uint8_t *out) {
  const tw_surface *surface = filler->scene->surfaces[view->mesh];
  const tw_surface_group *group = &view->faces;
  tw_surface_reader_turn(filler->reader, surface, 0, 0);
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

/* ---- any view ------------------------------------------------------------------------------------------ */

/* Elements [first, first + count) of a view. out: [count][element_size], aligned for floats and 32-bit
 * indices unless the view is memory. */
static void fill(filler *filler, const tw_gltf_view *view, uint64_t first, size_t count, void *out) {

  switch (view->source) {
  case TW_GLTF_MEMORY: memcpy(out, (const uint8_t *)view->memory + first, count); return;
  case TW_GLTF_ROWS: fill_rows(filler, view, first, count, out); return;
  case TW_GLTF_TRIANGLES: fill_triangles(filler, view, first, count, out); return;
  }
}

static bool filler_allocate(filler *filler) {
  const tw_scene *scene = filler->scene;
  filler->corner_capacity = (size_t)4 * FACES_SCRATCH;
  for (uint32_t i = 0; i < scene->model->mesh_count; i++) {
    size_t three = 3 * tw_surface_largest_face(scene->surfaces[i]);
    if (three > filler->corner_capacity) filler->corner_capacity = three;
  }
  filler->rows = tw_alloc(ROWS_SCRATCH, sizeof *filler->rows);
  filler->corners = tw_alloc(filler->corner_capacity, sizeof *filler->corners);
  filler->triangles = tw_alloc(filler->corner_capacity, 3 * sizeof *filler->triangles);
  filler->reader =
      tw_surface_reader_create_shared(scene->surfaces, scene->model->mesh_count, TW_GLTF_STRIDE_MAX / 12);
  return filler->rows && filler->corners && filler->triangles && filler->reader;
}

static void filler_destroy(filler *filler) {
  if (!filler) return;
  tw_surface_reader_destroy(filler->reader);
  free(filler->rows);
  free(filler->corners);
  free(filler->triangles);
  free(filler);
}

/* The scene outlives it. NULL without memory. */
static filler *filler_create(const tw_scene *scene) {
  filler *filler = tw_alloc_zero(1, sizeof *filler);
  if (!filler) return NULL;
  filler->scene = scene;
  if (filler_allocate(filler)) return filler;
  filler_destroy(filler);
  return NULL;
}

/* ---- the stream: types --------------------------------------------------------------------------------- */

typedef struct text {
  char *bytes;
  size_t size;
} text;

struct tw_gltf_stream {
  tw_scene scene; /* a copy: the caller's struct may end */
  tw_gltf_plan plan;
  tw_gltf_json json;
  text head, tail; /* before and after the BIN chunk; one of them holds the JSON */
  char *rest;      /* the JSON in there after its brace */
  bool bounds_known, base64;
  uint64_t data_text_size; /* of the BIN chunk as it is sent */
  uint64_t size, position;
  filler *filler;
  uint64_t window_offset;
  size_t window_size;
  _Alignas(16) uint8_t window[WINDOW_SIZE];
  uint8_t group_bytes[GROUPS_A_PASS * 3];
};

/* ---- text around the data -------------------------------------------------------------------------------
 */

static char *append(char *out, const char *bytes, size_t size) {
  memcpy(out, bytes, size);
  return out + size;
}

static char *append_u32(char *out, uint64_t value) {
  for (int shift = 0; shift < 32; shift += 8) *out++ = (char)(value >> shift & 0xFF);
  return out;
}

static bool allocate_text(text *text, size_t size) {
  text->bytes = tw_alloc(size, 1);
  text->size = size;
  return text->bytes;
}

/* Header, JSON chunk, header of the BIN chunk. The JSON goes on after its brace with the buffer. */
static bool build_glb(tw_gltf_stream *stream) {
  static const char opening[] = "{\"buffers\":[{\"byteLength\":%" PRIu64 "}],";
  const tw_text *json = &stream->json.text;
  uint64_t data_size = stream->plan.data_size;
  char buffers[sizeof opening + 20] = "{";
  if (data_size) snprintf(buffers, sizeof buffers, opening, data_size);
  size_t buffers_size = strlen(buffers), rest_size = json->size - 1;
  size_t chunk_size = (buffers_size + rest_size + 3) / 4 * 4;
  stream->data_text_size = data_size;
  if (!allocate_text(&stream->head, 12 + 8 + chunk_size + (data_size ? 8 : 0))) return false;
  char *out = append(stream->head.bytes, "glTF", 4);
  out = append_u32(out, 2);
  out = append_u32(out, stream->head.size + data_size);
  out = append_u32(out, chunk_size);
  out = append(out, "JSON", 4);
  out = append(out, buffers, buffers_size);
  stream->rest = out;
  out = append(out, json->data + 1, rest_size);
  for (size_t i = buffers_size + rest_size; i < chunk_size; i++) *out++ = ' ';
  if (data_size) {
    out = append_u32(out, data_size);
    append(out, "BIN", 4);
  }
  return true;
}

/* The buffer's data URI stands at the beginning, so that the rest is one text after it. */
static bool build_gltf(tw_gltf_stream *stream) {
  static const char opening[] =
      "{\"buffers\":[{\"byteLength\":%" PRIu64 ",\"uri\":\"data:application/octet-stream;base64,";
  const tw_text *json = &stream->json.text;
  uint64_t data_size = stream->plan.data_size;
  char buffers[sizeof opening + 20] = "{";
  if (data_size) snprintf(buffers, sizeof buffers, opening, data_size);
  const char *closing = data_size ? "\"}]," : "";
  stream->base64 = true;
  stream->data_text_size = (data_size + 2) / 3 * 4;
  if (!allocate_text(&stream->head, strlen(buffers)) ||
      !allocate_text(&stream->tail, strlen(closing) + json->size - 1))
    return false;
  append(stream->head.bytes, buffers, stream->head.size);
  char *out = append(stream->tail.bytes, closing, strlen(closing));
  stream->rest = out;
  append(out, json->data + 1, json->size - 1);
  return true;
}

static void write_bound(char *out, float bound) {
  char number[TW_NUMBER_TEXT];
  memcpy(out, number, tw_print_double(number, (double)bound));
}

/* Fills in the bounds that the JSON left room for. A double that is a float takes 23 characters. */
static bool write_bounds(tw_gltf_stream *stream) {
  size_t(*places)[6] = stream->json.bounds;
  for (uint32_t i = 0; i < stream->plan.accessor_count; i++) {
    const tw_gltf_accessor *accessor = &stream->plan.accessors[i];
    if (accessor->bounds != TW_GLTF_BOUNDED_LATER) continue;
    float min[3], max[3];
    if (tw_surface_bounds(stream->scene.surfaces[accessor->mesh], accessor->morph, min, max) != TW_OK)
      return false;
    for (int axis = 0; axis < 3; axis++) {
      write_bound(stream->rest + (*places)[axis] - 1, max[axis]);
      write_bound(stream->rest + (*places)[3 + axis] - 1, min[axis]);
    }
    places++;
  }
  return true;
}

/* Bounds cost a pass over the surface, so they are computed when the text is first read. */
static size_t read_text(tw_gltf_stream *stream, const text *text, uint64_t offset, uint8_t *out,
                        size_t capacity) {
  if (!stream->bounds_known) stream->bounds_known = write_bounds(stream);
  if (!stream->bounds_known) return 0;
  size_t left = text->size - (size_t)offset, size = left < capacity ? left : capacity;
  memcpy(out, text->bytes + offset, size);
  return size;
}

/* ---- data ---------------------------------------------------------------------------------------------- */

/* The last view that begins at or before an offset. */
static const tw_gltf_view *find_view(const tw_gltf_plan *plan, uint64_t offset) {
  uint32_t low = 0, high = plan->view_count;
  while (high - low > 1) {
    uint32_t middle = low + (high - low) / 2;
    if (plan->views[middle].offset <= offset)
      low = middle;
    else
      high = middle;
  }
  return &plan->views[low];
}

static size_t read_window(tw_gltf_stream *stream, uint64_t offset, uint8_t *out, size_t capacity) {
  size_t from = (size_t)(offset - stream->window_offset);
  size_t size = (size_t)least(stream->window_size - from, capacity);
  memcpy(out, stream->window + from, size);
  return size;
}

/* At least one byte of the BIN chunk; offset lies in it. */
static size_t read_data(tw_gltf_stream *stream, uint64_t offset, uint8_t *out, size_t capacity) {
  if (offset >= stream->window_offset && offset - stream->window_offset < stream->window_size)
    return read_window(stream, offset, out, capacity);
  const tw_gltf_view *view = find_view(&stream->plan, offset);
  uint64_t within = offset - view->offset;
  if (within >= view->size) { /* up to the next view at a multiple of 4 */
    size_t size = (size_t)least(4 - offset % 4, capacity);
    memset(out, 0, size);
    return size;
  }
  uint64_t first = within / view->element_size, count = view->size / view->element_size - first;
  bool aligned = view->source == TW_GLTF_MEMORY || (uintptr_t)out % sizeof(float) == 0;
  if (capacity >= DIRECT_SIZE && aligned && within % view->element_size == 0) {
    count = least(count, capacity / view->element_size);
    fill(stream->filler, view, first, (size_t)count, out);
    return (size_t)count * view->element_size;
  }
  count = least(count, WINDOW_SIZE / view->element_size);
  fill(stream->filler, view, first, (size_t)count, stream->window);
  stream->window_offset = view->offset + first * view->element_size;
  stream->window_size = (size_t)count * view->element_size;
  return read_window(stream, offset, out, capacity);
}

static void read_data_fully(tw_gltf_stream *stream, uint64_t offset, uint8_t *out, size_t size) {
  for (size_t done = 0; done < size;) done += read_data(stream, offset + done, out + done, size - done);
}

/* size: 1 to 3 bytes. */
static void write_group(const uint8_t *bytes, size_t size, uint8_t out[4]) {
  static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  uint32_t bits = (uint32_t)bytes[0] << 16;
  if (size > 1) bits |= (uint32_t)bytes[1] << 8;
  if (size > 2) bits |= bytes[2];
  for (int i = 0; i < 4; i++) out[i] = (uint8_t)letters[bits >> (18 - 6 * i) & 63];
  for (size_t i = size; i < 3; i++) out[i + 1] = '=';
}

/* Whole groups as far as capacity goes, else a part of one. */
static size_t read_base64(tw_gltf_stream *stream, uint64_t offset, uint8_t *out, size_t capacity) {
  uint64_t first = offset / 4, groups = stream->data_text_size / 4 - first;
  bool whole = offset % 4 == 0 && capacity >= 4;
  groups = whole ? least(least(groups, capacity / 4), GROUPS_A_PASS) : 1;
  size_t size = (size_t)least(3 * groups, stream->plan.data_size - 3 * first);
  read_data_fully(stream, 3 * first, stream->group_bytes, size);
  uint8_t part[4];
  for (size_t i = 0; i < groups; i++)
    write_group(stream->group_bytes + 3 * i, (size_t)least(3, size - 3 * i), whole ? out + 4 * i : part);
  if (whole) return (size_t)groups * 4;
  size_t skip = (size_t)(offset % 4), taken = (size_t)least(4 - skip, capacity);
  memcpy(out, part + skip, taken);
  return taken;
}

/* ---- the stream ---------------------------------------------------------------------------------------- */

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "no memory for a glTF stream");
}

/* Fills a zeroed stream with all that its size depends on. */
static tw_status prepare(tw_gltf_stream *stream, const tw_scene *scene, tw_format container,
                         tw_error *error) {
  stream->scene = *scene;
  tw_status status = tw_gltf_plan_init(&stream->plan, scene, error);
  if (status == TW_OK) status = tw_gltf_json_init(&stream->json, &stream->plan, scene, error);
  if (status != TW_OK) return status;
  bool glb = container == TW_FORMAT_GLB;
  if (!(glb ? build_glb(stream) : build_gltf(stream))) return no_memory(error);
  tw_text_deinit(&stream->json.text); /* copied into head or tail */
  stream->size = stream->head.size + stream->data_text_size + stream->tail.size;
  if (glb && stream->size > UINT32_MAX)
    return tw_fail(error, TW_LIMIT, "a GLB holds at most 4294967295 bytes, the answer has %" PRIu64,
                   stream->size);
  return TW_OK;
}

tw_status tw_gltf_stream_create(const tw_scene *scene, tw_format container, tw_gltf_stream **out,
                                tw_error *error) {
  tw_gltf_stream *stream = tw_alloc_zero(1, sizeof *stream);
  if (!stream) return no_memory(error);
  tw_status status = prepare(stream, scene, container, error);
  if (status == TW_OK) {
    stream->filler = filler_create(&stream->scene);
    if (!stream->filler) status = no_memory(error);
  }
  if (status == TW_OK)
    *out = stream;
  else
    tw_gltf_stream_destroy(stream);
  return status;
}

tw_status tw_gltf_stream_predict(const tw_scene *scene, tw_format container, uint64_t *size,
                                 tw_error *error) {
  tw_gltf_stream *stream = tw_alloc_zero(1, sizeof *stream);
  if (!stream) return no_memory(error);
  tw_status status = prepare(stream, scene, container, error);
  if (status == TW_OK) *size = stream->size;
  tw_gltf_stream_destroy(stream);
  return status;
}

void tw_gltf_stream_destroy(tw_gltf_stream *stream) {
  if (!stream) return;
  filler_destroy(stream->filler);
  tw_gltf_json_deinit(&stream->json);
  tw_gltf_plan_deinit(&stream->plan);
  free(stream->head.bytes);
  free(stream->tail.bytes);
  free(stream);
}

uint64_t tw_gltf_stream_size(const tw_gltf_stream *stream) {
  return stream->size;
}

void tw_gltf_stream_seek(tw_gltf_stream *stream, uint64_t offset) {
  stream->position = offset;
}

/* At least one byte unless there is no memory for the bounds; position lies in the stream. */
static size_t read_part(tw_gltf_stream *stream, uint8_t *out, size_t capacity) {
  uint64_t offset = stream->position;
  if (offset < stream->head.size) return read_text(stream, &stream->head, offset, out, capacity);
  offset -= stream->head.size;
  if (offset >= stream->data_text_size)
    return read_text(stream, &stream->tail, offset - stream->data_text_size, out, capacity);
  return stream->base64 ? read_base64(stream, offset, out, capacity)
                        : read_data(stream, offset, out, capacity);
}

size_t tw_gltf_stream_read(tw_gltf_stream *stream, uint8_t *out, size_t capacity) {
  size_t done = 0;
  while (done < capacity && stream->position < stream->size) {
    size_t size = read_part(stream, out + done, capacity - done);
    if (size == 0) break;
    done += size;
    stream->position += size;
  }
  return done;
}
