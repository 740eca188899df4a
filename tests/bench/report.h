/* What benchmarks share: clocks, medians, and rows that are printed and kept as JSON. */
#ifndef BENCH_REPORT_H
#define BENCH_REPORT_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { BENCH_RUNS = 9 };

/* Of BENCH_RUNS runs. */
typedef struct bench_timing {
  double median, least, most;
} bench_timing;

/* A value: rows go to standard output, and to `json` where it is open. */
typedef struct bench_report {
  FILE *json; /* an array of rows, or NULL */
  char scene[80];
  int row_count;
} bench_report;

/* Seconds of a clock that only goes forward. */
double bench_now(void);

/* In [0, 1), the same series in every run of a program. */
double bench_random(void);

/* Ends the program without memory. */
void *bench_alloc(size_t count, size_t size);

/* Sorts the runs. */
bench_timing bench_summary(double runs[BENCH_RUNS]);

/* path: of the JSON, NULL for none. Prints machine and compiler. */
void bench_open(bench_report *report, const char *path);
void bench_close(bench_report *report);

/* What the next rows are about. */
void bench_scene(bench_report *report, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* A row: what was measured, in `unit`. peer_name NULL: nothing stands beside it; else the ratio printed is
 * how many times better ours is. more_is_better: of a rate. */
void bench_row(bench_report *report, const char *name, const char *unit, bench_timing ours,
               const char *peer_name, bench_timing peer, bool more_is_better);

#ifdef __cplusplus
}
#endif
#endif
