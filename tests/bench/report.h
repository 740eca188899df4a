/* Shared by the benchmarks: clocks, medians, and rows that are printed and written as JSON. */
#ifndef BENCH_REPORT_H
#define BENCH_REPORT_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { BENCH_RUNS = 9 };

/* Summary of BENCH_RUNS runs. */
typedef struct bench_timing {
  double median, least, most;
} bench_timing;

/* A value. Rows go to standard output and, when it is open, to `json`. */
typedef struct bench_report {
  FILE *json; /* receives an array of rows, or NULL */
  char scene[80];
  int row_count;
} bench_report;

/* Monotonic time in seconds. */
double bench_now(void);

/* In [0, 1), the same series in every run of a program. */
double bench_random(void);

/* Allocates zeroed memory; exits when there is none. */
void *bench_alloc(size_t count, size_t size);

/* Sorts the runs and returns their summary. */
bench_timing bench_summary(double runs[BENCH_RUNS]);

/* Prints machine and compiler. path: of the JSON file, NULL for none. */
void bench_open(bench_report *report, const char *path);
void bench_close(bench_report *report);

/* Sets and prints the title of the next rows. */
void bench_scene(bench_report *report, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Prints a row. ours: in `unit`. peer_name NULL: without a peer; otherwise prints how many times better ours
 * is. more_is_better: true for a rate. */
void bench_row(bench_report *report, const char *name, const char *unit, bench_timing ours,
               const char *peer_name, bench_timing peer, bool more_is_better);

#ifdef __cplusplus
}
#endif
#endif
