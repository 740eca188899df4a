/* Reads any bytes as a mesh and options: what is read from its surface must be consistent. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "mesh_of_bytes.h"
#include "tweend/detail.h"
#include "tweend/format.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

/* The most corners of a tested surface. */
enum { ROWS = 1 << 13 };

static tw_surface_options take_options(source *s) {
  tw_surface_options options = {.level = take(s, 7),
                                .scheme = (tw_scheme)take(s, 3),
                                .boundary = (tw_boundary)take(s, 4),
                                .uv = (tw_uv_rule)take(s, 6),
                                .creasing = (tw_creasing)take(s, 2),
                                .triangles = (tw_triangles)take(s, 2),
                                .limit = take(s, 2),
                                .normals = take(s, 4)};
  uint32_t kind = take(s, 4);
  options.own_normals = options.level == 0 && options.normals && !options.limit && kind == 1;
  options.tagged = options.level == 0 && kind == 2;
  options.movable = kind == 3;
  return options;
}

/* ---- what is read is consistent -------------------------------------------------------------- */

static void demand(bool holds) {
  if (!holds) abort();
}

static void *must_allocate(size_t count, size_t size) {
  void *out = calloc(count + 1, size);
  demand(out);
  return out;
}

static size_t row_width(const tw_surface *surface, tw_domain domain) {
  return domain == TW_DOMAIN_POINTS ? 3
         : domain == TW_DOMAIN_UVS  ? 2
                                    : tw_surface_get_layout(surface)->stride;
}

/* Reads all rows, `block` at a time. */
static float *read_rows(const tw_surface *surface, tw_domain domain, size_t block) {
  size_t count = (size_t)tw_surface_row_count(surface, domain), width = row_width(surface, domain);
  float *out = must_allocate(count * width, sizeof *out);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  demand(reader);
  for (size_t first = 0; first < count; first += block)
    tw_surface_read_rows(reader, domain, first, count - first < block ? count - first : block,
                         out + first * width);
  tw_surface_reader_destroy(reader);
  return out;
}

static uint32_t *read_faces(const tw_surface *surface, tw_domain domain, size_t block) {
  const tw_surface_counts *counts = tw_surface_get_counts(surface);
  uint32_t *out = must_allocate((size_t)counts->corners, sizeof *out);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  demand(reader);
  size_t corners = 0, faces = (size_t)counts->faces;
  for (size_t first = 0; first < faces; first += block)
    corners += tw_surface_read_faces(reader, domain, first, faces - first < block ? faces - first : block,
                                     NULL, out + corners);
  demand(corners == counts->corners);
  tw_surface_reader_destroy(reader);
  return out;
}

static void check_values(const tw_surface *surface, const float *rows, size_t count) {
  const tw_surface_layout *l = tw_surface_get_layout(surface);
  float least[3] = {0}, greatest[3] = {0}, min[3], max[3];
  for (size_t r = 0; r < count; r++) {
    const float *row = rows + r * l->stride;
    for (uint32_t i = 0; i < l->stride; i++) demand(isfinite(row[i]));
    for (int c = 0; c < 3; c++) {
      least[c] = r == 0 ? row[c] : fminf(least[c], row[c]);
      greatest[c] = r == 0 ? row[c] : fmaxf(greatest[c], row[c]);
    }
    if (l->normal != UINT32_MAX) {
      const float *n = row + l->normal;
      demand(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-3f);
    }
    if (l->weights != UINT32_MAX) {
      float sum = 0;
      for (uint32_t k = 0; k < l->influences; k++) sum += row[l->weights + k];
      demand(fabsf(sum - 1) < 1e-3f);
    }
  }
  demand(tw_surface_bounds(surface, -1, min, max) == TW_OK);
  for (int c = 0; c < 3; c++) demand(min[c] == least[c] && max[c] == greatest[c]);
}

static void check_domain(const tw_surface *surface, tw_domain domain, size_t block) {
  const tw_surface_counts *counts = tw_surface_get_counts(surface);
  size_t rows = (size_t)tw_surface_row_count(surface, domain), size = rows * row_width(surface, domain);
  if (rows == 0) return;
  float *whole = read_rows(surface, domain, rows), *parts = read_rows(surface, domain, block);
  demand(memcmp(whole, parts, size * sizeof *whole) == 0);
  if (domain == TW_DOMAIN_VERTICES) check_values(surface, whole, rows);
  uint32_t *faces = read_faces(surface, domain, SIZE_MAX), *some = read_faces(surface, domain, block);
  demand(memcmp(faces, some, (size_t)counts->corners * sizeof *faces) == 0);
  for (uint64_t c = 0; c < counts->corners; c++) demand(faces[c] < rows);
  free(whole);
  free(parts);
  free(faces);
  free(some);
}

static bool is_small(const tw_mesh *mesh, const tw_surface_options *options, tw_surface_counts *counts) {
  return tw_surface_count(mesh, options, counts, NULL) == TW_OK && counts->corners <= ROWS;
}

/* A plan with new positions must give the same bytes as a mesh with these positions. */
static void check_moved(const tw_surface *plan, tw_mesh mesh, const float *positions) {
  tw_surface *moved, *fresh;
  if (tw_surface_with_positions_by(plan, positions, NULL, &moved) != TW_OK) return;
  mesh.positions = positions;
  demand(tw_surface_create(&mesh, tw_surface_get_options(plan), &fresh, NULL) == TW_OK);
  size_t rows = (size_t)tw_surface_row_count(plan, TW_DOMAIN_VERTICES);
  demand(tw_surface_row_count(fresh, TW_DOMAIN_VERTICES) == rows);
  float *a = read_rows(moved, TW_DOMAIN_VERTICES, 100), *b = read_rows(fresh, TW_DOMAIN_VERTICES, 100);
  demand(memcmp(a, b, rows * row_width(plan, TW_DOMAIN_VERTICES) * sizeof *a) == 0);
  free(a);
  free(b);
  tw_surface_destroy(moved);
  tw_surface_destroy(fresh);
}

/* The GLB of the surface must have the predicted size. */
static void check_file(const tw_mesh *mesh, const tw_surface *surface, tw_polygons polygons) {
  tw_node nodes[7] = {{.parent = TW_NO_INDEX, .mesh = 0, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY}};
  uint32_t joints[6] = {1, 2, 3, 4, 5, 6}, order[7] = {0, 1, 2, 3, 4, 5, 6};
  float inverse_bind[6][16] = {{0}};
  for (uint32_t i = 1; i < 7; i++) {
    nodes[i] = nodes[0];
    nodes[i].mesh = TW_NO_INDEX;
    for (uint32_t k = 0; k < 4; k++) inverse_bind[i - 1][5 * k] = 1;
  }
  tw_skin skin = {
      .joint_count = 6, .joints = joints, .inverse_bind = inverse_bind[0], .skeleton = TW_NO_INDEX};
  if (mesh->skin.joints) nodes[0].skin = 0;
  const char *groups[3] = {"a", "b", "a b"};
  const tw_model model = {.mesh_count = 1,
                          .meshes = (tw_mesh *)mesh,
                          .node_count = 7,
                          .nodes = nodes,
                          .node_order = order,
                          .skin_count = mesh->skin.joints ? 1 : 0,
                          .skins = &skin,
                          .group_count = 3,
                          .group_names = groups};
  const tw_scene scene = {.model = &model, .surfaces = &surface, .polygons = polygons};
  tw_gltf_stream *stream;
  uint64_t predicted, size = 0;
  if (tw_gltf_stream_create(&scene, TW_FORMAT_GLB, &stream, NULL) != TW_OK) return;
  demand(tw_gltf_stream_predict(&scene, TW_FORMAT_GLB, &predicted, NULL) == TW_OK);
  uint8_t block[1000];
  for (size_t count = 1; count > 0; size += count) count = tw_gltf_stream_read(stream, block, sizeof block);
  demand(size == predicted && size == tw_gltf_stream_size(stream));
  tw_gltf_stream_destroy(stream);
}

/* Sculpts a level: moves some of its points. Leaves the mesh as it is when the level cannot be sculpted. */
static void model_onto(source *s, tw_surface_options options, tw_arena *arena, tw_mesh *mesh) {
  tw_surface_counts counts;
  tw_surface *surface;
  tw_mesh sculpted;
  options.level = 1 + take(s, 2);
  options.movable = options.tagged = options.own_normals = false;
  if (!is_small(mesh, &options, &counts) || tw_surface_create(mesh, &options, &surface, NULL) != TW_OK)
    return;
  float *points = read_rows(surface, TW_DOMAIN_POINTS, 64);
  for (uint64_t i = 0; i < 3 * tw_surface_row_count(surface, TW_DOMAIN_POINTS); i++)
    if (take(s, 4) == 1) points[i] = take_number(s);
  if (tw_mesh_sculpt(mesh, &options, points, NULL, NULL, arena, &sculpted, NULL) == TW_OK) *mesh = sculpted;
  free(points);
  tw_surface_destroy(surface);
}

static void check_surface(source *s, const tw_mesh *mesh, const tw_surface_options *options) {
  tw_surface_counts counts;
  tw_surface *surface;
  if (!is_small(mesh, options, &counts) || tw_surface_create(mesh, options, &surface, NULL) != TW_OK) return;
  demand(memcmp(&counts, tw_surface_get_counts(surface), sizeof counts) == 0);
  size_t block = 1 + take(s, 200);
  for (int domain = TW_DOMAIN_POINTS; domain <= TW_DOMAIN_VERTICES; domain++)
    check_domain(surface, (tw_domain)domain, block);
  float moved[POINTS][3];
  take_numbers(s, moved[0], sizeof moved / sizeof **moved);
  if (options->movable) check_moved(surface, *mesh, moved[0]);
  check_file(mesh, surface, (tw_polygons)take(s, 2));
  tw_surface_destroy(surface);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  source s = {bytes, bytes + size};
  storage *own = must_allocate(1, sizeof *own);
  tw_arena *arena = tw_arena_create();
  tw_mesh mesh;
  const tw_surface_options options = take_options(&s);
  bool detailed = take(&s, 4) == 1;
  take_mesh(&s, own, &mesh);
  if (arena && tw_mesh_check(&mesh, NULL, NULL) == TW_OK) {
    if (detailed) model_onto(&s, options, arena, &mesh);
    source rest = s; /* read twice: files from before still mean the same faces */
    take_corner_values(&rest, own, &mesh);
    check_surface(&s, &mesh, &options);
  }
  tw_arena_destroy(arena);
  free(own);
  return 0;
}
