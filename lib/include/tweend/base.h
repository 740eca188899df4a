/* Status codes, error reports, memory, numbers and names: shared by every part of libtweend. */
#ifndef TWEEND_BASE_H
#define TWEEND_BASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#else
#include <stdatomic.h>
#endif

/* What went wrong. api/problem.c maps each to an HTTP status in one switch. */
typedef enum tw_status {
  TW_OK = 0,
  TW_SYNTAX,      /* the bytes are not a document of the format they claim to be */
  TW_INVALID,     /* well-formed, but not a usable model or request */
  TW_UNSUPPORTED, /* well-formed, and needs something that tweend does not do */
  TW_LIMIT,       /* over a configured or built-in limit */
  TW_NO_MEMORY,
  TW_CANCELLED /* the result is no longer wanted: tw_work said so, or is_cancelled of tw_parallel_for */
} tw_status;

/* Where a failure happened and why. Every function that takes one accepts NULL. */
typedef struct tw_error {
  tw_status status;
  uint64_t line;     /* OBJ: line number from 1; 0 where there is none */
  uint64_t column;   /* in that line, in characters from 1; 0 where it is not known */
  char pointer[160]; /* JSON documents: RFC 6901 pointer; "" where there is none */
  char detail[320];  /* one sentence for a person, UTF-8, never cut inside a character */
} tw_error;

#if defined(__GNUC__)
#define TW_PRINTF(text, rest) __attribute__((format(printf, text, rest)))
#else
#define TW_PRINTF(text, rest)
#endif

/* What stands behind a count: `one` behind 1, else `many`, noun and verb: "face is", "faces are". */
const char *tw_plural(uint64_t count, const char *one, const char *many);

/* Fills `error` (NULL allowed) with status and detail, clears its place, returns `status`. */
tw_status tw_fail(tw_error *error, tw_status status, const char *format, ...) TW_PRINTF(3, 4);

/* As tw_fail, with an OBJ line (from 1). */
tw_status tw_fail_line(tw_error *error, tw_status status, uint64_t line, const char *format, ...)
    TW_PRINTF(4, 5);

/* Sets the JSON pointer of an error that is already filled; returns its status.
 * Too long a pointer is cut at a '/'. NULL error: returns TW_INVALID. */
tw_status tw_error_at(tw_error *error, const char *format, ...) TW_PRINTF(2, 3);

/* Puts text before the sentence of an error that is already filled. NULL accepted. */
void tw_error_before(tw_error *error, const char *format, ...) TW_PRINTF(2, 3);

/* ---- arena: many allocations, one free ----------------------------------------------------------------- */

/* Grows in blocks; not thread-safe. Memory is aligned for any type. */
typedef struct tw_arena tw_arena;

tw_arena *tw_arena_create(void);        /* NULL without memory */
void tw_arena_destroy(tw_arena *arena); /* NULL accepted */

/* [count] elements of `size` bytes, zeroed; NULL on overflow or without memory. count 0 gives a
 * valid pointer to nothing. */
void *tw_arena_alloc(tw_arena *arena, size_t count, size_t size);
/* The same, not initialised: for arrays that are written before they are read. */
void *tw_arena_alloc_raw(tw_arena *arena, size_t count, size_t size);

/* A copy of `length` bytes of text with a terminator; NULL without memory. */
char *tw_arena_text(tw_arena *arena, const char *text, size_t length);

/* Bytes held, including those not yet handed out. */
size_t tw_arena_size(const tw_arena *arena);

/* malloc([count][size]) with the product checked; NULL on overflow, without memory, or where the meter
 * refuses. */
void *tw_alloc(size_t count, size_t size);
/* The same, zeroed. */
void *tw_alloc_zero(size_t count, size_t size);
/* realloc. */
void *tw_resize(void *memory, size_t bytes);
/* free; NULL accepted. Memory of tw_alloc may be freed by free too, and is then charged until its work ends.
 */
void tw_free(void *memory);

/* ---- meter: what one piece of work takes --------------------------------------------------------------- */

/* Memory and steps of one piece of work, such as an answer. Each thread has a current meter, or none.
 * What tw_alloc, tw_resize and arenas take is charged to the current meter, and given back to the meter that
 * is current when it is freed: whoever frees memory of other work uses no meter meanwhile. Loops of
 * tw_parallel_for run with the caller's meter. */
typedef struct tw_meter tw_meter;

/* Makes a meter the current one of this thread; NULL: none. Returns the one before. */
tw_meter *tw_meter_use(tw_meter *meter);
tw_meter *tw_meter_current(void);

/* Charges memory that is allocated elsewhere. False: the work may not hold so much. */
bool tw_meter_take(uint64_t bytes);
void tw_meter_give_back(uint64_t bytes);

/* Tells that about so many steps of a few nanoseconds have been done, or are about to be. False: the result
 * is no longer wanted, so stop; from then on it is false for all threads of the work. Long loops call it at
 * least once in some ten thousand steps. Without a meter: true. */
bool tw_work(uint64_t steps);
/* TW_CANCELLED where tw_work returned false, else TW_OK. */
tw_status tw_work_status(tw_error *error);

/* qsort as work: its memory is charged, and it ends where the work is over; what is left in `items` then is
 * of no use. Items that compare equal keep their order. TW_NO_MEMORY, TW_CANCELLED. O(count log count). */
tw_status tw_sort(void *items, size_t count, size_t size, int (*compare)(const void *, const void *));

#ifndef __cplusplus
/* Whose work it is. Both functions may be called on any thread of the work, also at the same time. */
typedef struct tw_meter_host {
  void *owner;
  /* Asked when more than the limit is to be held: returns the new limit. NULL: the limit is final. */
  uint64_t (*grant)(void *owner, uint64_t needed);
  bool (*is_over)(void *owner); /* whether the result is no longer wanted; NULL: never */
} tw_meter_host;

struct tw_meter {
  tw_meter_host host;
  _Atomic int64_t held, peak; /* bytes; held may fall below 0 while memory of other work is freed */
  _Atomic uint64_t limit,
      missing; /* missing: what would have been held when memory was refused last; 0: never */
  _Atomic uint64_t steps;
  atomic_bool is_over;
};

/* limit: bytes that may be held without asking the host. */
void tw_meter_init(tw_meter *meter, const tw_meter_host *host, uint64_t limit);
#endif

/* ---- threads ------------------------------------------------------------------------------------------- */

/* How the caller runs loops on its threads. run calls part(context, i) once for each i below count, in any
 * order and on any threads, and returns when all calls have. is_cancelled tells whether the result is no
 * longer wanted; it is called between the steps of long operations, on the thread that performs them. A NULL
 * is_cancelled: the result is always wanted. */
typedef struct tw_parallel_for {
  void *owner;
  void (*run)(void *owner, uint32_t count, void (*part)(void *context, uint32_t index), void *context);
  bool (*is_cancelled)(void *owner);
} tw_parallel_for;

/* ---- numbers as text ----------------------------------------------------------------------------------- */

enum { TW_NUMBER_TEXT = 32, TW_FLOAT_TEXT = 16 };

/* The shortest decimal text that reads back as the same value, valid as a JSON number; a value
 * that is not finite prints as null. Writes at most TW_NUMBER_TEXT bytes, no terminator, returns
 * the length. -0 prints as 0. Locale plays no part. */
size_t tw_print_float(char *out, float value);
size_t tw_print_double(char *out, double value);

/* [count] vectors of `width` numbers each, `stride` floats from one vector's start to the next. ends: NULL,
 * or [count] that receives the offset in the text at which each vector ends. */
typedef struct tw_vectors {
  const float *values;
  size_t stride, width, count;
  size_t *ends;
} tw_vectors;

/* Prints vectors as JSON arrays with commas between them, each number as tw_print_float prints it, up to six
 * times faster. out: room for TW_FLOAT_TEXT bytes for each number and 3 more for each vector. */
size_t tw_print_vectors(char *out, const tw_vectors *vectors);

/* Reads a decimal number from the start of text[0..length): JSON's grammar, and also a leading '+' or '.', as
 * in OBJ files. Returns the bytes used, 0 when there is no number. Overflow gives infinity. Locale plays no
 * part. */
size_t tw_read_double(const char *text, size_t length, double *out);

/* Writes the low 32 bits of a number, the lowest byte first, as binary formats want them on every machine.
 * Returns the end. */
static inline uint8_t *tw_put_u32(uint8_t *out, uint64_t value) {
  for (int shift = 0; shift < 32; shift += 8) *out++ = (uint8_t)(value >> shift);
  return out;
}

/* ---- UTF-8 --------------------------------------------------------------------------------------------- */

/* The size of the character at the start of text[0..length) in bytes; 0 when it is not well-formed (RFC 3629:
 * no overlong forms, no surrogates, nothing over U+10FFFF) or length is 0. */
size_t tw_utf8_length(const char *text, size_t length);

/* Whether text is well-formed UTF-8 without control characters: U+0000 to U+001F, U+007F to U+009F, and those
 * that break lines or turn the direction of text (U+2028 to U+202E, U+2066 to U+2069). */
bool tw_utf8_is_name(const char *text, size_t length);

/* Bytes of the longest name: files may refer to a name thousands of times, and answers print it each time. */
enum { TW_NAME_MAX = 1024 };

/* Copies text as a name: well-formed UTF-8, terminated. Text that is not UTF-8 is read as Latin-1; control
 * characters become blanks. NULL without memory. */
char *tw_arena_name(tw_arena *arena, const char *text, size_t length);

/* Version of the library, as "0.1.0". */
const char *tw_version(void);

#ifdef __cplusplus
}
#endif
#endif
