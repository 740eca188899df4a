#include "fail.h"

#include <stdarg.h>
#include <stdio.h>

const char *srv_plural(uint64_t count, const char *one, const char *many) {
  return count == 1 ? one : many;
}

bool srv_fail(srv_error *error, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(error->text, sizeof error->text, format, arguments);
  va_end(arguments);
  return false;
}
