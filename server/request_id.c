#include "request_id.h"

#include "machine.h"

#include <stdatomic.h>
#include <stdint.h>
#include <string.h>
#include <sys/random.h>

bool srv_request_id_is_valid(const char *id) {
  size_t size = strspn(id, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-");
  return size > 0 && size < SRV_REQUEST_ID_SIZE && id[size] == '\0';
}

static const char hex_digits[] = "0123456789abcdef";

bool srv_traceparent_is_valid(const char *text) {
  static const size_t ends[] = {2, 35, 52, 55};
  size_t at = 0;
  for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
    at += strspn(text + at, hex_digits);
    if (at != ends[i] || text[at++] != (i < 3 ? '-' : '\0')) return false;
  }
  return true;
}

/* Prints in hex, with at least `least` digits; returns the end. */
static char *print_hex(char *out, uint64_t value, unsigned least) {
  unsigned digits = least;
  while (digits < 16 && value >> 4 * digits > 0) digits++;
  while (digits-- > 0) *out++ = hex_digits[value >> 4 * digits & 15];
  return out;
}

/* The serial number makes the id unique within this process, the random prefix among processes. */
void srv_request_id_make(char out[SRV_REQUEST_ID_SIZE]) {
  static atomic_uint_fast64_t serial;
  static atomic_uint process;
  unsigned prefix = atomic_load_explicit(&process, memory_order_relaxed);
  if (prefix == 0) {
    unsigned fresh = 0;
    if (getrandom(&fresh, sizeof fresh, GRND_NONBLOCK) != (ssize_t)sizeof fresh)
      fresh = (unsigned)srv_now_ns();
    fresh |= 1;
    prefix = atomic_compare_exchange_strong(&process, &prefix, fresh) ? fresh : prefix;
  }
  char *end = print_hex(out, prefix, 8);
  *end++ = '-';
  *print_hex(end, atomic_fetch_add(&serial, 1), 1) = '\0';
}
