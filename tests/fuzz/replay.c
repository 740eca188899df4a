/* Runs a fuzz target over the files of a folder as an ordinary test (TAP), so that what libFuzzer found stays
 * fixed. Usage: PROGRAM FOLDER */
#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

/* Runs one file from an allocation of exactly its size, so that a sanitizer detects a read past the end. */
static int run_file(const char *path) {
  FILE *file = fopen(path, "rb");
  if (!file) return -1;
  long size = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
  uint8_t *bytes = size >= 0 ? malloc(size ? (size_t)size : 1) : NULL;
  rewind(file);
  int status = bytes && fread(bytes, 1, (size_t)size, file) == (size_t)size ? 0 : -1;
  fclose(file);
  if (status == 0) LLVMFuzzerTestOneInput(bytes, (size_t)size);
  free(bytes);
  return status;
}

int main(int argc, char **argv) {
  struct dirent **names = NULL;
  int count = argc == 2 ? scandir(argv[1], &names, NULL, alphasort) : -1, tests = 0, failures = 0;
  if (count < 0) {
    fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 2;
  }
  for (int i = 0; i < count; i++) {
    char path[4096];
    int length = snprintf(path, sizeof path, "%s/%s", argv[1], names[i]->d_name);
    if (names[i]->d_name[0] != '.' && length > 0 && (size_t)length < sizeof path) {
      int failed = run_file(path) != 0;
      failures += failed;
      printf("%sok %d - %s\n", failed ? "not " : "", ++tests, names[i]->d_name);
      fflush(stdout); /* so that a crash does not lose the line */
    }
    free(names[i]);
  }
  free(names);
  printf("1..%d\n", tests);
  return failures ? 1 : 0;
}
