#include "keyring.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "test.h"

typedef struct fixture {
  char path[32], setting[40];
  srv_error error;
  srv_config config;
  srv_keyring keyring;
} fixture;

static int set_up(void **state) {
  fixture *f = calloc(1, sizeof *f);
  strcpy(f->path, "/tmp/tweend-keys-XXXXXX");
  close(mkstemp(f->path));
  snprintf(f->setting, sizeof f->setting, "@%s", f->path);
  f->config.api_keys = f->setting;
  f->config.url_keys = "";
  *state = f;
  return 0;
}

static int tear_down(void **state) {
  fixture *f = *state;
  srv_keyring_deinit(&f->keyring);
  unlink(f->path);
  free(f);
  return 0;
}

static bool read_file(fixture *f, const char *text) {
  FILE *file = fopen(f->path, "w");
  assert_non_null(file);
  fputs(text, file);
  fclose(file);
  srv_keyring_deinit(&f->keyring);
  f->error.text[0] = '\0';
  return srv_keyring_read(&f->config, &f->keyring, &f->error);
}

static bool read_list(fixture *f, const char *list, const char *url_keys) {
  f->config.api_keys = (char *)(uintptr_t)list;
  f->config.url_keys = (char *)(uintptr_t)url_keys;
  srv_keyring_deinit(&f->keyring);
  bool is_read = srv_keyring_read(&f->config, &f->keyring, &f->error);
  f->config.api_keys = f->setting;
  return is_read;
}

static void assert_key(const fixture *f, size_t i, const char *text, unsigned rights, uint32_t count,
                       uint32_t period_s) {
  const api_key *key = &f->keyring.list.keys[i];
  assert_true(i < f->keyring.list.count);
  assert_string_equal(key->text, text);
  assert_int_equal(key->rights, rights);
  assert_int_equal(key->rate.count, count);
  assert_int_equal(key->rate.period_s, period_s);
}

enum { ALL = API_MAY_READ | API_MAY_WRITE | API_MAY_DELETE };

TEST_WITH(a_file_has_a_key_its_rights_and_its_rate_in_a_line, set_up, tear_down) {
  fixture *f = *state;
  assert_true(read_file(f, "# who may what\none\r\n\n  two read\nthree read,write,delete 50/s\nfour 100/m\n"
                           "five\tdelete\t2/h"));
  assert_int_equal(f->keyring.list.count, 5);
  assert_key(f, 0, "one", ALL, 0, 0);
  assert_key(f, 1, "two", API_MAY_READ, 0, 0);
  assert_key(f, 2, "three", ALL, 50, 1);
  assert_key(f, 3, "four", ALL, 100, 60);
  assert_key(f, 4, "five", API_MAY_DELETE, 2, 3600);
}

TEST_WITH(lines_that_are_no_key_are_named_without_their_text, set_up, tear_down) {
  fixture *f = *state;
  static const char *const bad[] = {"ok\ns3cret reed",       "ok\ns3cret read 5/d",     "ok\ns3cret read 0/s",
                                    "ok\ns3cret 5/s read",   "ok\ns3cret read write",   "ok\ns3cret,other",
                                    "ok\ns3cret read 5/s x", "ok\ns3cret read 5/s 5/s", "ok\ns3cret ,"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    if (read_file(f, bad[i])) fail_msg("%s is taken", bad[i]);
    assert_non_null(strstr(f->error.text, "line 2"));
    assert_null(strstr(f->error.text, "s3cret,"));
    assert_int_equal(f->keyring.list.count, 0);
  }
}

TEST_WITH(a_file_without_a_key_locks_nothing_open, set_up, tear_down) {
  fixture *f = *state;
  assert_false(read_file(f, "\n# none\n"));
  assert_non_null(strstr(f->error.text, "--api-keys"));
  unlink(f->path);
  assert_false(srv_keyring_read(&f->config, &f->keyring, &f->error));
  assert_non_null(strstr(f->error.text, f->path));
}

/* As read from a file of --url-keys, into the fixture's keyring. */
static bool read_url_file(fixture *f, const char *text) {
  FILE *file = fopen(f->path, "w");
  assert_non_null(file);
  fputs(text, file);
  fclose(file);
  return read_list(f, "", f->setting);
}

TEST_WITH(a_file_has_a_key_for_urls_in_a_line, set_up, tear_down) {
  fixture *f = *state;
  assert_true(read_url_file(f, "# keys of the site\n\nrose\r\n  old \n  # last year's\n"));
  assert_int_equal(f->keyring.list.url_count, 2);
  assert_string_equal(f->keyring.list.url_keys[0].text, "rose");
  assert_string_equal(f->keyring.list.url_keys[1].text, "old");
  static const char *const bad[] = {"ok\ns3cret other", "ok\ns3cret\tother", "ok\ns3cret,other",
                                    "ok\ns3cret # mine"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    if (read_url_file(f, bad[i])) fail_msg("%s is taken", bad[i]);
    assert_non_null(strstr(f->error.text, "--url-keys: line 2"));
    assert_null(strstr(f->error.text, "s3cret"));
  }
  assert_false(read_url_file(f, "# none\n"));
}

TEST_WITH(an_item_of_a_list_has_no_blank_in_it, set_up, tear_down) {
  fixture *f = *state;
  static const char *const bad[] = {"one, s3cret read 50/s", "one,s3cret read", "one,s3cret\tread",
                                    "one,s3cret\nread"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    if (read_list(f, bad[i], "")) fail_msg("%s is taken", bad[i]);
    assert_non_null(strstr(f->error.text, "--api-keys: item 2"));
    assert_null(strstr(f->error.text, "s3cret"));
    assert_int_equal(f->keyring.list.count, 0);
    if (read_list(f, "", bad[i])) fail_msg("%s is taken", bad[i]);
    assert_non_null(strstr(f->error.text, "--url-keys: item 2"));
    assert_null(strstr(f->error.text, "s3cret"));
  }
}

TEST_WITH(a_list_has_keys_alone, set_up, tear_down) {
  fixture *f = *state;
  assert_true(read_list(f, "one, two\n", "u,v"));
  assert_int_equal(f->keyring.list.count, 2);
  assert_key(f, 0, "one", ALL, 0, 0);
  assert_key(f, 1, "two", ALL, 0, 0);
  assert_int_equal(f->keyring.list.url_count, 2);
  assert_string_equal(f->keyring.list.url_keys[1].text, "v");
  assert_true(read_list(f, "", ""));
  assert_int_equal(f->keyring.list.count, 0);
  assert_false(read_list(f, " , ", ""));
  assert_false(read_list(f, "", ","));
  assert_non_null(strstr(f->error.text, "--url-keys"));
}
