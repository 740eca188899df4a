/* Measures shells: a pass over all triangles in chunks of a fixed length, several at a time. A chunk sums up
 * runs of triangles of one shell; the runs of all chunks are added in order, so that the sums are the same at
 * any number of threads. */
#include "face_shells.h"
#include "flat.h"
#include "parallel_for.h"
#include "tweend/shells.h"

#include <math.h>

enum { CHUNK = TW_FLAT_FACES, CHUNKS_MAX = 8, LEAST = 1 };

typedef struct shell_run {
  uint32_t shell, faces, triangles;
  double area, volume;
} shell_run;

typedef struct chunk {
  tw_surface_reader *reader;
  tw_flat_tools tools;
  uint32_t run_count;
  shell_run *runs; /* [CHUNK] */
} chunk;

typedef struct measure {
  const tw_face_shells *shells;
  tw_flat_part part;
  uint64_t first, triangles; /* the first triangle of the chunks that are computed now; of the surface */
  chunk chunks[CHUNKS_MAX];
} measure;

/* ---- chunks ---------------------------------------------------------------------------------- */

static void add_triangle(shell_run *run, const float *a, const float *b, const float *c) {
  double p[3], u[3], v[3];
  for (int i = 0; i < 3; i++) {
    p[i] = (double)a[i];
    u[i] = (double)b[i] - p[i];
    v[i] = (double)c[i] - p[i];
  }
  double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
  run->area += sqrt(x * x + y * y + z * z) / 2;
  run->volume += (p[0] * x + p[1] * y + p[2] * z) / 6;
  run->triangles++;
}

static void measure_chunk(const measure *m, uint64_t first, chunk *out) {
  const tw_surface *surface = m->part.surface;
  uint64_t last = tw_least(first + CHUNK, m->triangles), face = tw_face_of_triangle(surface, first);
  uint32_t second = m->part.is_mirrored ? 2 : 1;
  out->run_count = 0;
  while (first < last) {
    uint32_t count = tw_flat_read_triangles(&out->tools, &m->part, first, last - first);
    const uint32_t *places = out->tools.places[0];
    const float *points = out->tools.points.values;
    for (uint32_t i = 0; i < count; face++) {
      uint64_t stop = tw_least(tw_triangles_before(surface, face + 1), first + count);
      uint32_t shell = tw_face_shell(m->shells, face);
      if (out->run_count == 0 || out->runs[out->run_count - 1].shell != shell)
        out->runs[out->run_count++] = (shell_run){.shell = shell};
      out->runs[out->run_count - 1].faces += first + i == tw_triangles_before(surface, face);
      for (; first + i < stop; i++, places += 3)
        add_triangle(&out->runs[out->run_count - 1], points + 3 * (size_t)places[0],
                     points + 3 * (size_t)places[second], points + 3 * (size_t)places[3 - second]);
      if (stop < tw_triangles_before(surface, face + 1)) break; /* the face goes on in the next read */
    }
    first += count;
  }
}

static void measure_chunks(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  measure *m = context;
  (void)part;
  for (uint32_t i = begin; i < end; i++) measure_chunk(m, m->first + (uint64_t)i * CHUNK, &m->chunks[i]);
}

/* ---- all ------------------------------------------------------------------------------------- */

static bool open_chunk(const tw_surface *surface, chunk *c) {
  c->runs = tw_alloc(CHUNK, sizeof *c->runs);
  return c->runs && tw_flat_tools_init(&c->tools, &surface, 1);
}

static void close_chunk(chunk *c) {
  tw_flat_tools_deinit(&c->tools);
  tw_free(c->runs);
}

static void add_runs(const chunk *c, tw_shell *shells) {
  for (uint32_t i = 0; i < c->run_count; i++) {
    tw_shell *shell = &shells[c->runs[i].shell];
    shell->faces += c->runs[i].faces;
    shell->triangles += c->runs[i].triangles;
    shell->area += c->runs[i].area;
    shell->volume += c->runs[i].volume;
  }
}

static tw_status run_chunks(measure *m, uint32_t at_once, const tw_parallel_for *parallel, tw_shell *shells) {
  enum { STEPS_A_TRIANGLE = 10 };
  for (; m->first < m->triangles; m->first += (uint64_t)at_once * CHUNK) {
    uint64_t left = m->triangles - m->first;
    uint32_t count = (uint32_t)tw_least((left + CHUNK - 1) / CHUNK, at_once);
    tw_status status = tw_parallel_for_status(parallel);
    if (status != TW_OK || !tw_work(tw_least(left, (uint64_t)count * CHUNK) * STEPS_A_TRIANGLE))
      return TW_CANCELLED;
    tw_parallel_for_run(parallel, count, LEAST, measure_chunks, m);
    for (uint32_t i = 0; i < count; i++) add_runs(&m->chunks[i], shells);
  }
  return TW_OK;
}

static tw_status measure_all(measure *m, const tw_parallel_for *parallel, tw_shell *shells) {
  uint64_t chunks = (m->triangles + CHUNK - 1) / CHUNK;
  uint32_t at_once = tw_parallel_for_parts(parallel, (uint32_t)tw_least(chunks, CHUNKS_MAX), LEAST), open = 0;
  tw_status status = TW_OK;
  for (; open < at_once && status == TW_OK; open++)
    if (!open_chunk(m->part.surface, &m->chunks[open])) status = TW_NO_MEMORY;
  if (status == TW_OK) status = run_chunks(m, at_once, parallel, shells);
  while (open > 0) close_chunk(&m->chunks[--open]);
  return status;
}

static void finish(const tw_face_shells *found, tw_shell *shells) {
  for (uint32_t i = 0; i < found->count; i++) {
    tw_shell *shell = &shells[i];
    const tw_shell_edges *edges = &found->edges[i];
    shell->open_edges = edges->open;
    shell->crowded_edges = edges->crowded;
    shell->flipped_edges = edges->flipped;
    shell->is_closed = edges->open + edges->crowded + edges->flipped == 0;
    if (!shell->is_closed) shell->volume = 0;
  }
}

/* Measures a part, as tw_shells_measure. */
static tw_status measure_part(const tw_flat_part *part, const tw_parallel_for *parallel, tw_shell **shells,
                              uint32_t *count, tw_error *error) {
  const tw_surface_group faces = tw_flat_faces(part->surface);
  tw_face_shells found;
  tw_status status = tw_face_shells_find(part->surface, &found, error);
  measure *m = status == TW_OK ? tw_alloc_zero(1, sizeof *m) : NULL;
  tw_shell *all = m ? tw_alloc_zero(found.count, sizeof *all) : NULL;
  if (status == TW_OK && !all) status = tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (status == TW_OK) {
    m->shells = &found;
    m->part = *part;
    m->triangles = tw_count_triangles(&faces);
    status = measure_all(m, parallel, all);
    if (status != TW_OK)
      tw_fail(error, status, status == TW_CANCELLED ? "the shells are not wanted any more" : "out of memory");
  }
  if (status == TW_OK) {
    finish(&found, all);
    *shells = all;
    *count = found.count;
  } else {
    tw_free(all);
  }
  tw_free(m);
  tw_face_shells_deinit(&found);
  return status;
}

tw_status tw_shells_measure(const tw_surface *surface, const tw_parallel_for *parallel, tw_shell **shells,
                            uint32_t *count, tw_error *error) {
  const tw_flat_part part = {.surface = surface, .matrix = {[0] = 1, [5] = 1, [10] = 1}};
  return measure_part(&part, parallel, shells, count, error);
}

void tw_solid_add(tw_solid *solid, const tw_shell *shell) {
  solid->shells++;
  solid->closed += shell->is_closed;
  solid->inverted += shell->volume < 0;
  solid->triangles += shell->triangles;
  solid->open_edges += shell->open_edges;
  solid->crowded_edges += shell->crowded_edges;
  solid->flipped_edges += shell->flipped_edges;
  solid->area += shell->area;
  solid->volume += shell->volume;
}

tw_status tw_scene_measure(const tw_scene *scene, double scale, const tw_parallel_for *parallel,
                           tw_solid *out, tw_error *error) {
  tw_flat_scene flat;
  tw_status status = TW_OK;
  if (!tw_flat_place(scene, scale, &flat)) status = tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (status == TW_OK) status = tw_flat_check(&flat, error);
  *out = (tw_solid){0};
  for (uint32_t i = 0; i < flat.part_count && status == TW_OK; i++) {
    tw_shell *shells = NULL;
    uint32_t count = 0;
    status = measure_part(&flat.parts[i], parallel, &shells, &count, error);
    for (uint32_t k = 0; k < count; k++) tw_solid_add(out, &shells[k]);
    tw_free(shells);
  }
  tw_flat_deinit(&flat);
  return status;
}
