/* Linked with `free` wrapped. */
#include <malloc.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "test.h"

static _Thread_local const char *searched; /* text that freed blocks are searched for; NULL: they are not */
static _Thread_local bool is_found;

/* The linker's --wrap gives these names.
 * NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
void __real_free(void *block);
void __wrap_free(void *block);

void __wrap_free(void *block) {
  if (block != NULL && searched != NULL &&
      memmem(block, malloc_usable_size(block), searched, strlen(searched)) != NULL)
    is_found = true;
  __real_free(block);
}
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */

#ifdef TWEEND_S3
#include "s3_credentials.h"

TEST(secrets_of_a_file_do_not_stay_in_memory) {
  static const char TEXT[] = "[default]\naws_access_key_id = key\naws_secret_access_key = very-s3cret\n";
  char path[] = "/tmp/tweend-credentials-XXXXXX";
  int file = mkstemp(path);
  assert_int_equal(write(file, TEXT, strlen(TEXT)), strlen(TEXT));
  close(file);
  srv_s3_credentials credentials;
  srv_error error;
  is_found = false;
  searched = "very-s3cret";
  bool is_read = srv_s3_credentials_read(path, &credentials, &error);
  searched = NULL;
  unlink(path);
  assert_true(is_read);
  assert_string_equal(credentials.secret, "very-s3cret");
  assert_false(is_found);
}
#endif
