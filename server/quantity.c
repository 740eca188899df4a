/* A quantity is digits and one unit out of a table. */
#include "quantity.h"

#include <stddef.h>
#include <string.h>

typedef struct unit {
  const char *name;
  uint64_t factor;
} unit;

static const unit SIZE_UNITS[] = {
    {"", 1},
    {"B", 1},
    {"KiB", UINT64_C(1) << 10},
    {"MiB", UINT64_C(1) << 20},
    {"GiB", UINT64_C(1) << 30},
    {"TiB", UINT64_C(1) << 40},
    {"kB", 1000},
    {"MB", 1000000},
    {"GB", 1000000000},
    {"TB", UINT64_C(1000000000000)},
};
static const unit COUNT_UNITS[] = {{"", 1}, {"k", 1000}, {"M", 1000000}, {"G", 1000000000}};
static const unit DURATION_UNITS[] = {{"ms", 1}, {"s", 1000}, {"m", 60000}, {"h", 3600000}};

/* Returns the text behind the digits, NULL when there are none or too many. */
static const char *read_digits(const char *text, uint64_t *out) {
  const char *at = text;
  uint64_t number = 0;
  for (; *at >= '0' && *at <= '9'; at++) {
    uint64_t digit = (uint64_t)(*at - '0');
    if (number > (UINT64_MAX - digit) / 10) return NULL;
    number = number * 10 + digit;
  }
  if (at == text) return NULL;
  *out = number;
  return at;
}

static bool read_quantity(const char *text, const unit *units, size_t unit_count, uint64_t *out) {
  uint64_t number;
  const char *name = read_digits(text, &number);
  if (name == NULL) return false;
  for (size_t i = 0; i < unit_count; i++) {
    if (strcmp(name, units[i].name) != 0) continue;
    if (number > UINT64_MAX / units[i].factor) return false;
    *out = number * units[i].factor;
    return true;
  }
  return false;
}

bool srv_parse_size(const char *text, uint64_t *out) {
  return read_quantity(text, SIZE_UNITS, sizeof SIZE_UNITS / sizeof *SIZE_UNITS, out);
}

bool srv_parse_count(const char *text, uint64_t *out) {
  return read_quantity(text, COUNT_UNITS, sizeof COUNT_UNITS / sizeof *COUNT_UNITS, out);
}

bool srv_parse_duration(const char *text, uint64_t *out) {
  if (strcmp(text, "0") == 0) {
    *out = 0;
    return true;
  }
  return read_quantity(text, DURATION_UNITS, sizeof DURATION_UNITS / sizeof *DURATION_UNITS, out);
}
