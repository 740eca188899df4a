/* Reads all rows of a surface. */
#ifndef SURFACE_ROWS_H
#define SURFACE_ROWS_H

#include <stdlib.h>

#include "test.h"
#include "tweend/subdiv.h"

typedef struct rows {
  tw_surface *surface;
  const tw_surface_layout *layout;
  float *values;
  size_t count;
} rows;

static inline tw_surface *surface_of(const tw_mesh *mesh, tw_surface_options options) {
  tw_surface *surface = NULL;
  tw_error error;
  assert_int_equal(tw_mesh_check(mesh, &error, NULL), TW_OK);
  assert_int_equal(tw_surface_create(mesh, &options, &surface, &error), TW_OK);
  return surface;
}

/* [rows][floats of a row of the domain]; the caller frees it. */
static inline float *all_rows(const tw_surface *surface, tw_domain domain) {
  size_t count = (size_t)tw_surface_row_count(surface, domain);
  float *values = malloc((count * tw_surface_get_layout(surface)->stride + 3) * sizeof *values);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  assert_non_null(values);
  assert_non_null(reader);
  tw_surface_read_rows(reader, domain, 0, count, values);
  tw_surface_reader_destroy(reader);
  return values;
}

static inline rows read_rows(const tw_mesh *mesh, tw_surface_options options) {
  rows r = {.surface = surface_of(mesh, options)};
  r.layout = tw_surface_get_layout(r.surface);
  r.count = (size_t)tw_surface_row_count(r.surface, TW_DOMAIN_VERTICES);
  r.values = all_rows(r.surface, TW_DOMAIN_VERTICES);
  return r;
}

static inline void free_rows(rows *r) {
  free(r->values);
  tw_surface_destroy(r->surface);
}

static inline const float *row_of(const rows *r, size_t i) {
  return r->values + i * r->layout->stride;
}

/* [corners], face by face; the caller frees it. */
static inline uint32_t *faces_of(const rows *r, tw_domain domain) {
  const tw_surface_counts *counts = tw_surface_get_counts(r->surface);
  uint32_t *faces = malloc((counts->corners + 1) * sizeof *faces);
  tw_surface_reader *reader = tw_surface_reader_create(r->surface);
  assert_non_null(faces);
  assert_non_null(reader);
  size_t written = tw_surface_read_faces(reader, domain, 0, (size_t)counts->faces, NULL, faces);
  assert_int_equal(written, counts->corners);
  tw_surface_reader_destroy(reader);
  return faces;
}

/* Asserts that the bounds, which are found without evaluating every patch, are those of the rows. */
static inline void assert_exact_bounds(const rows *r) {
  float min[3], max[3];
  assert_int_equal(tw_surface_bounds(r->surface, -1, min, max), TW_OK);
  for (int c = 0; c < 3; c++) {
    float low = row_of(r, 0)[c], high = low;
    for (size_t i = 0; i < r->count; i++) {
      if (row_of(r, i)[c] < low) low = row_of(r, i)[c];
      if (row_of(r, i)[c] > high) high = row_of(r, i)[c];
    }
    assert_true(min[c] == low && max[c] == high);
  }
}

/* Asserts that blocks of any size give the same rows. */
static inline void assert_same_in_blocks(const rows *r) {
  enum { MOST = 61 };
  float *block = malloc(MOST * r->layout->stride * sizeof *block);
  tw_surface_reader *reader = tw_surface_reader_create(r->surface);
  assert_non_null(block);
  assert_non_null(reader);
  for (size_t first = 0, step = 1; first < r->count; first += step, step = step % MOST + 1) {
    size_t taken = first + step > r->count ? r->count - first : step;
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, first, taken, block);
    assert_memory_equal(block, row_of(r, first), taken * r->layout->stride * sizeof *block);
  }
  tw_surface_reader_destroy(reader);
  free(block);
}

#endif
