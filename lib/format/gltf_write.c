/* glTF answers, computed as they are read: some text, the BIN chunk (raw, or in base64), some text. Each
 * block of the BIN chunk is computed when it is read: rows by the surface, most of them straight into the
 * caller's memory, and faces as triangles. Reads that are too small or unaligned for that are served from a
 * window on the chunk, which keeps what it computed for the next reads. */
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "gltf/gltf.h"

enum {
  ROWS_SCRATCH = 4096,
  NARROWED = 2048,         /* triangles that are narrowed to 16 bits at a time */
  WINDOW_SIZE = 16 * 1024, /* no element is larger */
  DIRECT_SIZE = 4 * 1024,  /* reads of this size bypass the window */
  GROUPS_A_PASS = 4096     /* of base64: 3 bytes, 4 characters each */
};

struct tw_gltf_stream {
  tw_scene scene; /* a copy: the caller's struct may end */
  tw_gltf_plan plan;
  tw_text head, tail; /* before and after the BIN chunk */
  tw_text *json;      /* the one that holds the JSON */
  bool bounds_known, base64;
  uint64_t data_text_size; /* of the BIN chunk as it is sent */
  uint64_t size, position;
  /* What computes elements of views. */
  tw_pack_reader *packs;     /* if the scene has packs; otherwise these: */
  tw_surface_reader *reader; /* turned to the surface of the view */
  tw_triangulator triangles;
  float *rows;                 /* [ROWS_SCRATCH], for rows that are converted */
  uint32_t wide[3 * NARROWED]; /* triangles that are narrowed */
  uint64_t window_offset;
  size_t window_size;
  _Alignas(16) uint8_t window[WINDOW_SIZE];
  uint8_t group_bytes[GROUPS_A_PASS * 3];
};

/* ---- rows ------------------------------------------------------------------------------------ */

static void fill_rows(tw_gltf_stream *stream, const tw_gltf_view *view, uint64_t first, size_t count,
                      uint8_t *out) {
  const tw_surface *surface = stream->scene.surfaces[view->mesh];
  tw_surface_reader_turn(stream->reader, surface, view->first_target, view->target_count);
  uint32_t stride = tw_surface_reader_layout(stream->reader)->stride;
  if (tw_vertex_is_row(view->fields, view->field_count, stride)) {
    tw_surface_read_rows(stream->reader, TW_DOMAIN_VERTICES, first, count, (float *)(void *)out);
    return;
  }
  size_t batch = ROWS_SCRATCH / stride;
  for (size_t done = 0; done < count; done += batch) {
    size_t part = count - done < batch ? count - done : batch;
    tw_surface_read_rows(stream->reader, TW_DOMAIN_VERTICES, first + done, part, stream->rows);
    for (size_t i = 0; i < part; i++)
      tw_vertex_write(view->fields, view->field_count, stream->rows + i * stride,
                      out + (done + i) * view->element_size);
  }
}

/* ---- triangles ------------------------------------------------------------------------------- */

static void fill_triangles(tw_gltf_stream *stream, const tw_gltf_view *view, uint64_t first, size_t count,
                           uint8_t *out) {
  const tw_surface *surface = stream->scene.surfaces[view->mesh];
  if (view->element_size == 3 * sizeof(uint32_t)) {
    tw_triangulator_read(&stream->triangles, surface, &view->faces, first, count, (uint32_t *)(void *)out);
    return;
  }
  for (size_t done = 0; done < count; done += NARROWED) {
    size_t part = count - done < NARROWED ? count - done : NARROWED;
    tw_triangulator_read(&stream->triangles, surface, &view->faces, first + done, part, stream->wide);
    for (size_t i = 0; i < 3 * part; i++) {
      uint16_t index = (uint16_t)stream->wide[i];
      memcpy(out + (3 * done + i) * sizeof index, &index, sizeof index);
    }
  }
}

/* ---- any view -------------------------------------------------------------------------------- */

static bool fill_pack(tw_gltf_stream *stream, const tw_gltf_view *view, uint64_t first, size_t count,
                      uint8_t *out) {
  const tw_scene *scene = &stream->scene;
  const uint8_t *bytes = tw_pack_read(stream->packs, scene->packs[view->mesh], scene->surfaces[view->mesh],
                                      view->pack, view->part);
  if (bytes) memcpy(out, bytes + first, count);
  return bytes;
}

/* Elements [first, first + count) of a view. False without memory. out: [count][element_size], aligned for
 * floats and 32-bit indices unless the elements are bytes. */
static bool fill(tw_gltf_stream *stream, const tw_gltf_view *view, uint64_t first, size_t count, void *out) {
  switch (view->source) {
  case TW_GLTF_MEMORY: memcpy(out, (const uint8_t *)view->memory + first, count); return true;
  case TW_GLTF_ROWS: fill_rows(stream, view, first, count, out); return true;
  case TW_GLTF_TRIANGLES: fill_triangles(stream, view, first, count, out); return true;
  case TW_GLTF_PACK: return fill_pack(stream, view, first, count, out);
  }
  return false;
}

/* ---- text around the data -------------------------------------------------------------------- */

uint8_t *tw_glb_put_head(uint8_t *out, uint64_t json_size, uint64_t data_size) {
  memcpy(out, "glTF", 4);
  out = tw_put_u32(tw_put_u32(out + 4, 2), 12 + 8 + json_size + (data_size ? 8 + data_size : 0));
  out = tw_put_u32(out, json_size);
  memcpy(out, "JSON", 4);
  return out + 4;
}

uint8_t *tw_glb_put_bin_head(uint8_t *out, uint64_t data_size) {
  out = tw_put_u32(out, data_size);
  memcpy(out, "BIN", 4); /* and its terminator */
  return out + 4;
}

/* Prints the text around the data. GLB: header, JSON chunk, header of the BIN chunk. glTF: the data URI of
 * the buffer stands at the beginning, so that the rest is one text after it. A second buffer without bytes
 * stands for what compressed views decode to. Without data there is no buffer. False without memory. */
static bool put_text(tw_gltf_stream *stream, bool is_glb) {
  enum { HEAD = 20, BIN_HEAD = 8 };
  uint8_t bytes[HEAD] = {0};
  const tw_gltf_plan *plan = &stream->plan;
  tw_text *head = &stream->head, *text = head;
  if (is_glb) tw_text_bytes(head, (char *)bytes, HEAD);
  tw_text_add(head, "{");
  if (plan->data_size > 0) {
    tw_member_open(head, "buffers", "[{");
    tw_member_count(head, "byteLength", plan->data_size);
    if (!is_glb) {
      tw_text_add(head, ",\"uri\":\"data:application/octet-stream;base64,");
      text = &stream->tail;
      tw_text_add(text, "\"");
    }
    tw_text_add(text, "}");
    if (plan->decoded_size > 0) {
      tw_text_add(text, ",{");
      tw_member_count(text, "byteLength", plan->decoded_size);
      tw_text_add(text, ",\"extensions\":{\"" TW_GLTF_MESHOPT "\":{\"fallback\":true}}}");
    }
    tw_text_add(text, "]");
  }
  stream->json = text;
  tw_gltf_put_json(text, &stream->plan, &stream->scene);
  if (head->failed || text->failed) return false;
  if (is_glb) {
    tw_text_bytes(head, "   ", (4 - head->size % 4) % 4);
    tw_glb_put_bin_head(bytes, plan->data_size);
    uint64_t json_size = head->size - HEAD;
    if (plan->data_size > 0) tw_text_bytes(head, (char *)bytes, BIN_HEAD);
    tw_glb_put_head((uint8_t *)head->data, json_size, plan->data_size);
  }
  return !head->failed;
}

static void write_bounds_at(char *out, const float bounds[3]) {
  for (int axis = 0; axis < 3; axis++, out += TW_GLTF_BOUND_TEXT + 1) {
    char number[TW_NUMBER_TEXT];
    memcpy(out, number, tw_print_double(number, (double)bounds[axis]));
  }
}

static bool find_bounds(const tw_scene *scene, const tw_gltf_accessor *accessor, float min[3], float max[3]) {
  if (accessor->pack == TW_NO_INDEX)
    return tw_surface_bounds(scene->surfaces[accessor->mesh], accessor->morph, min, max) == TW_OK;
  const tw_pack_bounds *bounds =
      tw_packs_bounds(scene->packs[accessor->mesh], accessor->pack, accessor->morph);
  memcpy(min, bounds->min, sizeof bounds->min);
  memcpy(max, bounds->max, sizeof bounds->max);
  return true;
}

/* Fills in the bounds that the JSON left room for. A float printed as a double takes at most 23
 * characters. */
static bool write_bounds(tw_gltf_stream *stream) {
  for (uint32_t i = 0; i < stream->plan.accessor_count; i++) {
    const tw_gltf_accessor *accessor = &stream->plan.accessors[i];
    if (!accessor->is_bounded_later) continue;
    float min[3], max[3];
    if (!find_bounds(&stream->scene, accessor, min, max)) return false;
    write_bounds_at(stream->json->data + accessor->max_text, max);
    write_bounds_at(stream->json->data + accessor->min_text, min);
  }
  return true;
}

/* Bounds cost a pass over the surface, so they are computed when the text is first read. */
static size_t read_text(tw_gltf_stream *stream, const tw_text *text, uint64_t offset, uint8_t *out,
                        size_t capacity) {
  if (!stream->bounds_known) stream->bounds_known = write_bounds(stream);
  if (!stream->bounds_known) return 0;
  size_t left = text->size - (size_t)offset, size = left < capacity ? left : capacity;
  memcpy(out, text->data + offset, size);
  return size;
}

/* ---- data ------------------------------------------------------------------------------------ */

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
  size_t size = (size_t)tw_least(stream->window_size - from, capacity);
  memcpy(out, stream->window + from, size);
  return size;
}

/* Reads at least one byte of the BIN chunk, in which `offset` lies; 0 without memory. */
static size_t read_data(tw_gltf_stream *stream, uint64_t offset, uint8_t *out, size_t capacity) {
  if (offset >= stream->window_offset && offset - stream->window_offset < stream->window_size)
    return read_window(stream, offset, out, capacity);
  const tw_gltf_view *view = find_view(&stream->plan, offset);
  uint64_t within = offset - view->offset;
  if (within >= view->size) { /* padding up to the next view, at a multiple of 4 */
    size_t size = (size_t)tw_least(4 - offset % 4, capacity);
    memset(out, 0, size);
    return size;
  }
  uint64_t first = within / view->element_size, count = view->size / view->element_size - first;
  bool aligned = view->element_size == 1 || (uintptr_t)out % sizeof(float) == 0;
  if (capacity >= DIRECT_SIZE && aligned && within % view->element_size == 0) {
    count = tw_least(count, capacity / view->element_size);
    return fill(stream, view, first, (size_t)count, out) ? (size_t)count * view->element_size : 0;
  }
  count = tw_least(count, WINDOW_SIZE / view->element_size);
  stream->window_size = 0;
  if (!fill(stream, view, first, (size_t)count, stream->window)) return 0;
  stream->window_offset = view->offset + first * view->element_size;
  stream->window_size = (size_t)count * view->element_size;
  return read_window(stream, offset, out, capacity);
}

/* False without memory. */
static bool read_data_fully(tw_gltf_stream *stream, uint64_t offset, uint8_t *out, size_t size) {
  size_t part = 1;
  for (size_t done = 0; done < size && part > 0; done += part)
    part = read_data(stream, offset + done, out + done, size - done);
  return part > 0;
}

/* Encodes 1 to 3 bytes as a group of four characters. */
static void write_group(const uint8_t *bytes, size_t size, uint8_t out[4]) {
  static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  uint32_t bits = (uint32_t)bytes[0] << 16;
  if (size > 1) bits |= (uint32_t)bytes[1] << 8;
  if (size > 2) bits |= bytes[2];
  for (int i = 0; i < 4; i++) out[i] = (uint8_t)letters[bits >> (18 - 6 * i) & 63];
  for (size_t i = size; i < 3; i++) out[i + 1] = '=';
}

/* Reads whole groups as far as capacity goes, or a part of one group; 0 without memory. */
static size_t read_base64(tw_gltf_stream *stream, uint64_t offset, uint8_t *out, size_t capacity) {
  uint64_t first = offset / 4, groups = stream->data_text_size / 4 - first;
  bool whole = offset % 4 == 0 && capacity >= 4;
  groups = whole ? tw_least(tw_least(groups, capacity / 4), GROUPS_A_PASS) : 1;
  size_t size = (size_t)tw_least(3 * groups, stream->plan.data_size - 3 * first);
  if (!read_data_fully(stream, 3 * first, stream->group_bytes, size)) return 0;
  uint8_t part[4];
  for (size_t i = 0; i < groups; i++)
    write_group(stream->group_bytes + 3 * i, (size_t)tw_least(3, size - 3 * i), whole ? out + 4 * i : part);
  if (whole) return (size_t)groups * 4;
  size_t skip = (size_t)(offset % 4), taken = (size_t)tw_least(4 - skip, capacity);
  memcpy(out, part + skip, taken);
  return taken;
}

/* ---- the stream ------------------------------------------------------------------------------ */

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "no memory for a glTF stream");
}

/* Fills a zeroed stream with all that its size depends on. */
static tw_status prepare(tw_gltf_stream *stream, const tw_scene *scene, tw_format container,
                         tw_error *error) {
  stream->scene = *scene;
  tw_status status = tw_gltf_plan_init(&stream->plan, scene, error);
  if (status != TW_OK) return status;
  stream->base64 = container != TW_FORMAT_GLB;
  if (!put_text(stream, !stream->base64)) return no_memory(error);
  uint64_t data_size = stream->plan.data_size;
  stream->data_text_size = stream->base64 ? (data_size + 2) / 3 * 4 : data_size;
  stream->size = stream->head.size + stream->data_text_size + stream->tail.size;
  if (!stream->base64 && stream->size > UINT32_MAX)
    return tw_fail(error, TW_LIMIT, "a GLB holds at most 4294967295 bytes, the answer has %" PRIu64,
                   stream->size);
  return TW_OK;
}

/* False without memory. */
static bool prepare_reading(tw_gltf_stream *stream) {
  const tw_scene *scene = &stream->scene;
  uint32_t count = scene->model->mesh_count;
  if (scene->packs) {
    stream->packs = tw_pack_reader_create(scene->packs, scene->surfaces, count);
    return stream->packs;
  }
  stream->rows = tw_alloc(ROWS_SCRATCH, sizeof *stream->rows);
  stream->reader = tw_surface_reader_create_shared(scene->surfaces, count, TW_DISPLACEMENTS_MAX);
  return stream->rows && stream->reader &&
         tw_triangulator_init(&stream->triangles, scene->surfaces, count, scene->polygons, stream->reader);
}

tw_status tw_gltf_stream_create(const tw_scene *scene, tw_format container, tw_gltf_stream **out,
                                tw_error *error) {
  tw_gltf_stream *stream = tw_alloc_zero(1, sizeof *stream);
  if (!stream) return no_memory(error);
  tw_status status = prepare(stream, scene, container, error);
  if (status == TW_OK && !prepare_reading(stream)) status = no_memory(error);
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
  tw_pack_reader_destroy(stream->packs);
  tw_triangulator_deinit(&stream->triangles);
  tw_surface_reader_destroy(stream->reader);
  tw_free(stream->rows);
  tw_gltf_plan_deinit(&stream->plan);
  tw_text_deinit(&stream->head);
  tw_text_deinit(&stream->tail);
  tw_free(stream);
}

uint64_t tw_gltf_stream_size(const tw_gltf_stream *stream) {
  return stream->size;
}

void tw_gltf_stream_seek(tw_gltf_stream *stream, uint64_t offset) {
  stream->position = offset;
}

/* Reads at least one byte; 0 without memory. `position` lies in the stream. */
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
