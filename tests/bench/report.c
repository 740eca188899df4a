/* Clocks, medians, and rows of results. */
#include "report.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

double bench_now(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

double bench_random(void) {
  static uint64_t seed = 1;
  seed = seed * 6364136223846793005u + 1442695040888963407u;
  return (double)(seed >> 11) / 9007199254740992.0;
}

void *bench_alloc(size_t count, size_t size) {
  void *memory = calloc(count ? count : 1, size);
  if (memory) return memory;
  fprintf(stderr, "no memory\n");
  exit(1);
}

static int compare(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

bench_timing bench_summary(double runs[BENCH_RUNS]) {
  qsort(runs, BENCH_RUNS, sizeof *runs, compare);
  return (bench_timing){runs[BENCH_RUNS / 2], runs[0], runs[BENCH_RUNS - 1]};
}

void bench_open(bench_report *report, const char *path) {
  *report = (bench_report){.json = path ? fopen(path, "w") : NULL};
  if (path && !report->json) {
    perror(path);
    exit(1);
  }
  char line[256] = "";
  FILE *info = fopen("/proc/cpuinfo", "r");
  while (info && fgets(line, sizeof line, info))
    if (strncmp(line, "model name", 10) == 0) break;
  if (info) fclose(info);
  const char *model = strchr(line, ':');
  printf("%s", model ? model + 2 : "unknown machine\n");
#ifdef __VERSION__
  printf("compiler %s; median of %d runs or more (least to most)\n", __VERSION__, BENCH_RUNS);
#endif
  if (report->json) fputs("[", report->json);
}

void bench_close(bench_report *report) {
  if (!report->json) return;
  fputs("\n]\n", report->json);
  fclose(report->json);
}

void bench_scene(bench_report *report, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(report->scene, sizeof report->scene, format, arguments);
  va_end(arguments);
  printf("%s\n", report->scene);
}

static void print_json(FILE *out, bench_timing timing) {
  fprintf(out, "\"median\": %.6g, \"least\": %.6g, \"most\": %.6g", timing.median, timing.least, timing.most);
}

void bench_row(bench_report *report, const char *name, const char *unit, bench_timing ours,
               const char *peer_name, bench_timing peer, bool more_is_better) {
  double ratio = more_is_better ? ours.median / peer.median : peer.median / ours.median;
  printf("  %-34s %10.2f %s (%.2f to %.2f)", name, ours.median, unit, ours.least, ours.most);
  if (peer_name) printf("   %s %.2f, ratio %.2f", peer_name, peer.median, ratio);
  printf("\n");
  if (!report->json) return;
  fprintf(report->json, "%s\n  {\"scene\": \"%s\", \"name\": \"%s\", \"unit\": \"%s\", ",
          report->row_count++ ? "," : "", report->scene, name, unit);
  print_json(report->json, ours);
  if (peer_name) {
    fprintf(report->json, ", \"peer\": {\"name\": \"%s\", ", peer_name);
    print_json(report->json, peer);
    fprintf(report->json, "}, \"ratio\": %.4g", ratio);
  }
  fputs("}", report->json);
}
