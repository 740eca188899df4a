/* A model for benchmarks. */
#include "bench_model.h"

#include "report.h"

#include <stdio.h>

char *bench_model(int joints, int keys, size_t *size) {
  char *text = NULL;
  FILE *out = open_memstream(&text, size);
  if (!out) bench_alloc(SIZE_MAX, 1);
  fputs("{\"nodes\":[", out);
  for (int i = 0; i < joints; i++) {
    fprintf(out, "%s{\"name\":\"joint_%d\",\"translation\":[0,0.3,0]", i ? "," : "", i);
    if (i) fprintf(out, ",\"parent\":\"joint_%d\"", (i - 1) / 2);
    fputs("}", out);
  }
  fputs("],\"clips\":[{\"name\":\"move\",\"tracks\":[", out);
  for (int i = 0; i < joints; i++) {
    fprintf(out, "%s{\"node\":\"joint_%d\",\"path\":\"rotation\",\"times\":[", i ? "," : "", i);
    for (int key = 0; key < keys; key++)
      fprintf(out, "%s%.6f", key ? "," : "",
              10.0 * (key + (key % (keys - 1) ? 0.8 * bench_random() : 0)) / (keys - 1));
    fputs("],\"quaternions\":[", out);
    for (int key = 0; key < keys; key++)
      fprintf(out, "%s[%.7f,%.7f,%.7f,%.7f]", key ? "," : "", bench_random() - 0.5, bench_random() - 0.5,
              bench_random() - 0.5, bench_random() + 0.1);
    fputs("]}", out);
  }
  fputs("]}]}", out);
  if (fclose(out) != 0) bench_alloc(SIZE_MAX, 1);
  return text;
}
