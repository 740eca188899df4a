/* Errors with their places in a model, and checks of names. */
#include "model_checks.h"

#include <string.h>

#include "tweend/base.h"

tw_status tw_model_fail_at(tw_error *error, const char *array, uint32_t index, const char *rest,
                           const char *detail) {
  tw_fail(error, TW_INVALID, "%s", detail);
  tw_error_at(error, "/%s/%u%s", array, index, rest);
  return TW_INVALID;
}

void tw_model_prefix(tw_error *error, const char *array, uint32_t index) {
  if (!error) return;
  char relative[sizeof error->pointer];
  memcpy(relative, error->pointer, sizeof relative);
  tw_error_at(error, "/%s/%u%s", array, index, relative);
}

tw_status tw_model_check_name(const char **name, const char *array, uint32_t index, tw_error *error) {
  if (!*name) return TW_OK;
  if (!tw_utf8_is_name(*name, strlen(*name)))
    return tw_model_fail_at(error, array, index, "/name",
                            "a name must be UTF-8 text without control characters");
  if (strlen(*name) > TW_NAME_MAX)
    return tw_model_fail_at(error, array, index, "/name", "a name has at most 1024 bytes");
  if (!**name) *name = NULL;
  return TW_OK;
}
