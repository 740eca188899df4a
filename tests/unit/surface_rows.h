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

static inline tw_surface *surface_of(const tw_mesh *mesh, tw_surface_options options) {
  tw_surface *surface = NULL;
  tw_error error;
  assert_int_equal(tw_mesh_check(mesh, &error, NULL), TW_OK);
  assert_int_equal(tw_surface_create(mesh, &options, &surface, &error), TW_OK);
  return surface;
}

/* [rows][floats of a row of the domain]; freed by the caller. */
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

#endif
