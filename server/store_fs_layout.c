#include "store_fs_layout.h"

#include "disk.h"
#include "log.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SUMMARY_MAX = 1 << 20 };

srv_path srv_store_folder_path(const char *root, const char *name) {
  srv_path p;
  snprintf(p.text, sizeof p.text, "%s/%s", root, name);
  return p;
}

srv_path srv_store_prefix_path(const char *root, const char *kind, const char *id) {
  srv_path p;
  snprintf(p.text, sizeof p.text, "%s/%s/%.2s", root, kind, id);
  return p;
}

srv_path srv_store_object_path(const char *root, const char *id) {
  srv_path p;
  snprintf(p.text, sizeof p.text, "%s/objects/%.2s/%s", root, id, id);
  return p;
}

srv_path srv_store_summary_path(const char *root, const char *id) {
  srv_path p;
  snprintf(p.text, sizeof p.text, "%s/summaries/%.2s/%s", root, id, id + 2);
  return p;
}

char *srv_store_read_summary(const char *root, const char *id) {
  srv_path name = srv_store_summary_path(root, id);
  char *text = srv_read_text(name.text, SUMMARY_MAX);
  if (text && text[0] != '\0') return text;
  free(text);
  return NULL;
}

api_store_status srv_store_unavailable(const char *what) {
  bool is_full = errno == ENOSPC || errno == EDQUOT;
  srv_log(SRV_LOG_ERROR, "store: %s: %s", what, strerror(errno));
  return is_full ? API_STORE_FULL : API_STORE_UNAVAILABLE;
}

api_store_status srv_store_not_found(const char *root) {
  srv_path objects = srv_store_folder_path(root, "objects/.");
  return access(objects.text, F_OK) == 0 ? API_STORE_ABSENT
                                         : srv_store_unavailable("cannot find the folder of models");
}
