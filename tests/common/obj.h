/* Reads models from OBJ text. */
#ifndef TEST_OBJ_H
#define TEST_OBJ_H

#include <string.h>

#include "test.h"
#include "tweend/format.h"

/* Fails the test when the text is refused. */
static inline tw_model *read_obj_with(const char *text, tw_weld weld) {
  tw_model *model = NULL;
  tw_error error = {0};
  if (tw_obj_read((const uint8_t *)text, strlen(text), weld, &model, &error) != TW_OK)
    fail_msg("line %u: %s", (unsigned)error.line, error.detail);
  return model;
}

static inline tw_model *read_obj(const char *text) {
  return read_obj_with(text, TW_WELD_AUTO);
}

#endif
