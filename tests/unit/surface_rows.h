/* All rows of a surface, for tests that look at them. */
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

static inline rows read_rows(const tw_mesh *mesh, tw_surface_options options) {
  rows r = {0};
  tw_error error;
  assert_int_equal(tw_mesh_check(mesh, &error, NULL), TW_OK);
  assert_int_equal(tw_surface_create(mesh, &options, &r.surface, &error), TW_OK);
  r.layout = tw_surface_get_layout(r.surface);
  r.count = (size_t)tw_surface_row_count(r.surface, TW_DOMAIN_VERTICES);
  r.values = malloc((r.count * r.layout->stride + 1) * sizeof(float));
  tw_surface_reader *reader = tw_surface_reader_create(r.surface);
  assert_non_null(r.values);
  assert_non_null(reader);
  tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, 0, r.count, r.values);
  tw_surface_reader_destroy(reader);
  return r;
}

static inline void free_rows(rows *r) {
  free(r->values);
  tw_surface_destroy(r->surface);
}

static inline const float *row_of(const rows *r, size_t i) {
  return r->values + i * r->layout->stride;
}

#endif
