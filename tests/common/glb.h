/* Builds and reads glTF files for tests, from JSON text with ' in place of " and bytes for the BIN chunk. */
#ifndef TEST_GLB_H
#define TEST_GLB_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "quotes.h"
#include "tweend/format.h"

/* What every glTF has. */
#define ASSET "'asset':{'version':'2.0'}"

typedef struct glb_file {
  uint8_t *bytes;
  size_t size;
} glb_file;

static inline void glb_put_u32(uint8_t *at, uint32_t value) {
  for (int i = 0; i < 4; i++) at[i] = (uint8_t)(value >> (8 * i));
}

/* bin_size 0: no BIN chunk. The caller frees the bytes. */
static inline glb_file glb_build(const char *json, const void *bin, size_t bin_size) {
  size_t text = strlen(json), json_size = (text + 3) / 4 * 4, padded = (bin_size + 3) / 4 * 4;
  glb_file file = {NULL, 20 + json_size + (bin_size ? 8 + padded : 0)};
  file.bytes = calloc(file.size, 1);
  assert_non_null(file.bytes);
  memcpy(file.bytes, "glTF", 4);
  glb_put_u32(file.bytes + 4, 2);
  glb_put_u32(file.bytes + 8, (uint32_t)file.size);
  glb_put_u32(file.bytes + 12, (uint32_t)json_size);
  memcpy(file.bytes + 16, "JSON", 4);
  memset(file.bytes + 20, ' ', json_size);
  memcpy(file.bytes + 20, json, text);
  quote_bytes(file.bytes + 20, text);
  if (bin_size) {
    glb_put_u32(file.bytes + 20 + json_size, (uint32_t)padded);
    memcpy(file.bytes + 24 + json_size, "BIN", 4);
    memcpy(file.bytes + 28 + json_size, bin, bin_size);
  }
  return file;
}

/* Warning `number` of a model, without those of accessors and views that a fixture has to spare; NULL beyond
 * the last. */
static inline const char *glb_warning(const tw_model *model, uint32_t number) {
  for (uint32_t i = 0; i < model->warning_count; i++)
    if (!strstr(model->warnings[i], "left out: nothing that is read names") && number-- == 0)
      return model->warnings[i];
  return NULL;
}

static inline uint32_t glb_warning_count(const tw_model *model) {
  uint32_t count = 0;
  while (glb_warning(model, count)) count++;
  return count;
}

/* Reads a copy of exactly `size` bytes, so that a sanitizer detects a read past the end. */
static inline tw_status gltf_read_bytes(const void *bytes, size_t size, uint64_t json_values,
                                        tw_model **model, tw_error *error) {
  uint8_t *copy = malloc(size ? size : 1);
  assert_non_null(copy);
  memcpy(copy, bytes, size);
  tw_status status = tw_gltf_read(copy, size, TW_QUADS_NGON, TW_WELD_AUTO, json_values, model, error);
  free(copy);
  return status;
}

/* Reads JSON alone, as a .gltf file. */
static inline tw_status gltf_read(const char *json, uint64_t json_values, tw_model **model, tw_error *error) {
  char *text = quoted(json);
  tw_status status = gltf_read_bytes(text, strlen(text), json_values, model, error);
  free(text);
  return status;
}

/* Reads JSON and BIN; prints a refusal and fails the test. */
static inline tw_model *glb_read_with(const char *json, const void *bin, size_t bin_size, tw_quads quads) {
  glb_file file = glb_build(json, bin, bin_size);
  tw_model *model = NULL;
  tw_error error = {0};
  tw_status status = tw_gltf_read(file.bytes, file.size, quads, TW_WELD_AUTO, 0, &model, &error);
  free(file.bytes);
  if (status != TW_OK) print_error("%s: %s\n", error.pointer, error.detail);
  assert_int_equal(status, TW_OK);
  return model;
}

static inline tw_model *glb_read(const char *json, const void *bin, size_t bin_size) {
  return glb_read_with(json, bin, bin_size, TW_QUADS_NGON);
}

/* Asserts that the document is refused with this status and JSON pointer. */
static inline void glb_refused(const char *json, const void *bin, size_t bin_size, tw_status expected,
                               const char *pointer) {
  glb_file file = glb_build(json, bin, bin_size);
  tw_model *untouched = NULL;
  tw_error error = {0};
  tw_status status = tw_gltf_read(file.bytes, file.size, TW_QUADS_NGON, TW_WELD_AUTO, 0, &untouched, &error);
  free(file.bytes);
  if (status != expected || strcmp(error.pointer, pointer) != 0)
    print_error("%s\n-> status %d, %s: %s\n", json, (int)status, error.pointer, error.detail);
  assert_int_equal(status, expected);
  assert_string_equal(error.pointer, pointer);
  assert_true(error.detail[0] != '\0');
  assert_null(untouched);
}

/* Whether one of the warnings has these words. */
static inline bool warns_of(const tw_model *model, const char *words) {
  for (uint32_t i = 0; i < model->warning_count; i++)
    if (strstr(model->warnings[i], words)) return true;
  return false;
}

#endif
