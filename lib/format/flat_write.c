/* STL, PLY and points, computed as they are read: a head, then segments of elements. The place of an element
 * follows from its number, so reading can begin anywhere. */
#include "flat.h"

#include <stdlib.h>
#include <string.h>

typedef enum segment_kind { SEGMENT_FACETS, SEGMENT_VERTICES, SEGMENT_FACES } segment_kind;

typedef struct segment {
  segment_kind kind;
  uint32_t part;
  uint64_t offset, count; /* first byte in the answer; elements */
} segment;

struct tw_flat_stream {
  tw_flat_scene flat;
  tw_flat_form form;
  const char *unit;
  tw_ply_layout ply;
  tw_text head;
  uint32_t segment_count;
  segment *segments; /* [segment_count + 1], the last one is the end */
  uint64_t position;
  tw_flat_tools tools;
  uint8_t *block; /* bytes [block_begin, block_end) of the answer */
  uint64_t block_begin, block_end;
};

/* ---- sizes ----------------------------------------------------------------------------------- */

/* Bytes of the elements of a segment before this one. */
static uint64_t bytes_before(const tw_flat_stream *stream, const segment *s, uint64_t element) {
  const tw_ply_layout *ply = &stream->ply;
  if (s->kind == SEGMENT_FACETS) return element * TW_STL_FACET;
  if (s->kind == SEGMENT_VERTICES) return element * ply->vertex_size;
  if (!ply->is_ngon) return element * (ply->face_size + 3 * (uint64_t)ply->per_edge);
  const tw_surface *surface = stream->flat.parts[s->part].surface;
  return element * ply->face_size + tw_surface_corners_before(surface, element) * ply->per_edge;
}

static uint64_t count_elements(const tw_flat_stream *stream, segment_kind kind, uint32_t part) {
  const tw_surface *surface = stream->flat.parts[part].surface;
  const tw_surface_group faces = tw_flat_faces(surface);
  if (kind == SEGMENT_VERTICES) return tw_surface_row_count(surface, TW_DOMAIN_POINTS);
  return kind == SEGMENT_FACES && stream->ply.is_ngon ? faces.face_count : tw_count_triangles(&faces);
}

static void add_segments(tw_flat_stream *stream, segment_kind kind, uint64_t *offset) {
  for (uint32_t part = 0; part < stream->flat.part_count; part++) {
    segment *s = &stream->segments[stream->segment_count++];
    *s = (segment){kind, part, *offset, count_elements(stream, kind, part)};
    *offset += bytes_before(stream, s, s->count);
  }
}

static tw_status lay_out_stl(tw_flat_stream *stream, tw_error *error) {
  uint64_t triangles = 0;
  uint8_t head[TW_STL_HEAD];
  for (uint32_t i = 0; i < stream->flat.part_count; i++)
    triangles += count_elements(stream, SEGMENT_FACETS, i);
  if (triangles > UINT32_MAX)
    return tw_fail(error, TW_LIMIT, "%llu triangles are more than STL can count",
                   (unsigned long long)triangles);
  tw_stl_put_head(&stream->flat, stream->unit, triangles, head);
  tw_text_bytes(&stream->head, (char *)head, sizeof head);
  return TW_OK;
}

static tw_status lay_out_ply(tw_flat_stream *stream, tw_error *error) {
  uint64_t points = 0;
  for (uint32_t i = 0; i < stream->flat.part_count; i++)
    points += count_elements(stream, SEGMENT_VERTICES, i);
  if (points > UINT32_MAX)
    return tw_fail(error, TW_LIMIT, "%llu vertices are more than PLY can number", (unsigned long long)points);
  stream->ply = tw_ply_lay_out(&stream->flat);
  tw_ply_put_head(&stream->flat, &stream->ply, stream->unit, &stream->head);
  return TW_OK;
}

static tw_status lay_out_points(tw_flat_stream *stream, const tw_flat_options *options) {
  stream->ply = tw_points_lay_out(options->has_normals, options->has_uvs);
  return tw_points_put_head(&stream->flat, &stream->ply, &stream->head) ? TW_OK : TW_NO_MEMORY;
}

static tw_status lay_out_head(tw_flat_stream *stream, const tw_flat_options *options, tw_error *error) {
  switch (options->form) {
  case TW_FLAT_STL: return lay_out_stl(stream, error);
  case TW_FLAT_PLY: return lay_out_ply(stream, error);
  case TW_FLAT_POINTS: return lay_out_points(stream, options);
  }
  return TW_INVALID;
}

/* Everything but what computes elements. */
static tw_status lay_out(tw_flat_stream *stream, const tw_scene *scene, const tw_flat_options *options,
                         tw_error *error) {
  stream->form = options->form;
  stream->unit = options->unit;
  if (!tw_flat_place(scene, options->scale, &stream->flat)) return TW_NO_MEMORY;
  stream->segments = tw_alloc(2 * (size_t)stream->flat.part_count + 1, sizeof *stream->segments);
  if (!stream->segments) return TW_NO_MEMORY;
  tw_status status = lay_out_head(stream, options, error);
  if (status != TW_OK || stream->head.failed) return status != TW_OK ? status : TW_NO_MEMORY;
  uint64_t offset = stream->head.size;
  if (stream->form == TW_FLAT_STL) add_segments(stream, SEGMENT_FACETS, &offset);
  if (stream->form != TW_FLAT_STL) add_segments(stream, SEGMENT_VERTICES, &offset);
  if (stream->form == TW_FLAT_PLY) add_segments(stream, SEGMENT_FACES, &offset);
  stream->segments[stream->segment_count].offset = offset;
  return TW_OK;
}

/* ---- create and destroy ---------------------------------------------------------------------- */

static bool allocate(tw_flat_stream *stream) {
  tw_flat_tools *tools = &stream->tools;
  const tw_scene *scene = &stream->flat.scene;
  const tw_ply_layout *ply = &stream->ply;
  if (!tw_flat_tools_init(tools, scene->surfaces, scene->model->mesh_count)) return false;
  size_t corners = tools->corner_capacity, facets = (size_t)TW_FLAT_FACES * TW_STL_FACET;
  if (stream->form == TW_FLAT_STL) {
    stream->block = tw_alloc(facets, 1);
    return stream->block;
  }
  size_t vertices = (size_t)TW_FLAT_ROWS * ply->vertex_size,
         faces = (size_t)TW_FLAT_FACES * ply->face_size + corners * ply->per_edge;
  if (ply->has_colors) tw_ply_find_levels(tools);
  tools->corners[1] = tw_alloc(ply->has_wedges ? corners : 0, sizeof(uint32_t));
  tools->places[1] = tw_alloc(ply->has_wedges ? corners : 0, sizeof(uint32_t));
  tools->sizes = tw_alloc(TW_FLAT_FACES, sizeof(uint32_t));
  tools->rows = tw_alloc(TW_FLAT_ROWS, TW_FLAT_ROW * sizeof(float));
  stream->block = tw_alloc(vertices > faces ? vertices : faces, 1);
  return tools->corners[1] && tools->places[1] && tools->sizes && tools->rows && stream->block &&
         (!ply->has_wedges || tw_row_pages_init(&tools->uvs, TW_DOMAIN_UVS));
}

tw_status tw_flat_stream_create(const tw_scene *scene, const tw_flat_options *options, tw_flat_stream **out,
                                tw_error *error) {
  tw_flat_stream *stream = tw_alloc_zero(1, sizeof *stream);
  tw_status status = stream ? lay_out(stream, scene, options, error) : TW_NO_MEMORY;
  if (status == TW_OK && stream->form != TW_FLAT_POINTS) status = tw_flat_check(&stream->flat, error);
  if (status == TW_OK && !allocate(stream)) status = TW_NO_MEMORY;
  if (status == TW_OK) {
    *out = stream;
    return TW_OK;
  }
  tw_flat_stream_destroy(stream);
  return status == TW_NO_MEMORY ? tw_fail(error, status, "no memory for a stream of triangles") : status;
}

void tw_flat_stream_destroy(tw_flat_stream *stream) {
  if (!stream) return;
  tw_flat_tools_deinit(&stream->tools);
  tw_free(stream->block);
  tw_free(stream->segments);
  tw_text_deinit(&stream->head);
  tw_flat_deinit(&stream->flat);
  tw_free(stream);
}

uint64_t tw_flat_stream_size(const tw_flat_stream *stream) {
  return stream->segments[stream->segment_count].offset;
}

bool tw_flat_stream_origin(const tw_flat_stream *stream, double origin[3]) {
  memcpy(origin, stream->flat.origin, sizeof stream->flat.origin);
  return stream->flat.is_moved;
}

uint32_t tw_flat_stream_far_count(const tw_flat_stream *stream) {
  return stream->flat.far_count;
}

tw_status tw_flat_stream_predict(const tw_scene *scene, const tw_flat_options *options, uint64_t *size,
                                 tw_error *error) {
  tw_flat_stream *stream = tw_alloc_zero(1, sizeof *stream);
  tw_status status = stream ? lay_out(stream, scene, options, error) : TW_NO_MEMORY;
  if (status == TW_OK) *size = tw_flat_stream_size(stream);
  tw_flat_stream_destroy(stream);
  return status == TW_NO_MEMORY ? tw_fail(error, status, "out of memory") : status;
}

/* ---- reading --------------------------------------------------------------------------------- */

/* The segment that holds a byte behind the head. */
static const segment *find_segment(const tw_flat_stream *stream, uint64_t offset) {
  uint32_t low = 0, high = stream->segment_count;
  while (high - low > 1) {
    uint32_t middle = low + (high - low) / 2;
    if (stream->segments[middle].offset <= offset)
      low = middle;
    else
      high = middle;
  }
  return &stream->segments[low];
}

/* The element of a segment that holds a byte, counted from the segment's first. */
static uint64_t find_element(const tw_flat_stream *stream, const segment *s, uint64_t byte) {
  uint64_t low = 0, high = s->count;
  while (high - low > 1) {
    uint64_t middle = low + (high - low) / 2;
    if (bytes_before(stream, s, middle) <= byte)
      low = middle;
    else
      high = middle;
  }
  return low;
}

/* Computes the block that begins with the element at the position. */
static void fill_block(tw_flat_stream *stream) {
  const segment *s = find_segment(stream, stream->position);
  const tw_flat_part *part = &stream->flat.parts[s->part];
  uint64_t first = find_element(stream, s, stream->position - s->offset), most = s->count - first, count = 0;
  switch (s->kind) {
  case SEGMENT_FACETS: count = tw_stl_put_facets(&stream->tools, part, first, most, stream->block); break;
  case SEGMENT_VERTICES:
    count = tw_ply_put_vertices(&stream->tools, part, &stream->ply, first, most, stream->block);
    break;
  case SEGMENT_FACES:
    count = tw_ply_put_faces(&stream->tools, part, &stream->ply, first, most, stream->block);
    break;
  }
  stream->block_begin = s->offset + bytes_before(stream, s, first);
  stream->block_end = s->offset + bytes_before(stream, s, first + count);
}

size_t tw_flat_stream_read(tw_flat_stream *stream, uint8_t *out, size_t capacity) {
  uint64_t size = tw_flat_stream_size(stream);
  size_t done = 0;
  while (done < capacity && stream->position < size) {
    const uint8_t *from = (const uint8_t *)stream->head.data + stream->position;
    uint64_t left = stream->head.size;
    if (stream->position >= stream->head.size) {
      bool is_there = stream->position >= stream->block_begin && stream->position < stream->block_end;
      if (!is_there) fill_block(stream);
      from = stream->block + (stream->position - stream->block_begin);
      left = stream->block_end;
    }
    size_t taken = (size_t)tw_least(left - stream->position, capacity - done);
    memcpy(out + done, from, taken);
    done += taken;
    stream->position += taken;
  }
  return done;
}

void tw_flat_stream_seek(tw_flat_stream *stream, uint64_t offset) {
  stream->position = offset;
}
