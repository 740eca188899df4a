/* The store of a test. */
#include "store_fixture.h"

#include <ftw.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mount.h>
#include <unistd.h>

void open_store(fixture *f) {
  srv_error error = {""};
  f->opened = srv_store_fs_open("--data", f->path, &error);
  if (f->opened == NULL) fail_msg("%s", error.text);
  f->store = srv_store_fs_api(f->opened);
}

int set_up_store(void **state) {
  fixture *f = calloc(1, sizeof *f);
  snprintf(f->path, sizeof f->path, "/tmp/tweend-store-XXXXXX");
  if (mkdtemp(f->path) == NULL) return -1;
  open_store(f);
  *state = f;
  return 0;
}

static int remove_entry(const char *path, const struct stat *facts, int type, struct FTW *place) {
  (void)facts;
  (void)type;
  (void)place;
  return remove(path);
}

int remove_folder(const char *path) {
  return nftw(path, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
}

int tear_down_store(void **state) {
  fixture *f = *state;
  srv_store_fs_close(f->opened);
  umount2(f->path, MNT_DETACH); /* where a test failed before it did */
  int status = remove_folder(f->path);
  free(f);
  return status;
}

void make_id(const char *bytes, size_t size, char id[API_ID_TEXT]) {
  struct sha256_ctx hash;
  uint8_t digest[(API_ID_TEXT - 1) / 2];
  sha256_init(&hash);
  sha256_update(&hash, size, (const uint8_t *)bytes);
  sha256_digest(&hash, sizeof digest, digest);
  for (size_t i = 0; i < sizeof digest; i++) snprintf(id + 2 * i, 3, "%02x", digest[i]);
}
