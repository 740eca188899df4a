/* Linked with strdup wrapped. */
#include "config.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "test.h"

static const char *variable, *variable_value;

static char *one_variable(const char *name) {
  bool asked = variable != NULL && strcmp(name, variable) == 0;
  return asked ? (char *)(uintptr_t)variable_value : NULL;
}

static void set_variable(const char *name, const char *value) {
  variable = name;
  variable_value = value;
}

typedef struct fixture {
  srv_config config;
  srv_error error;
  FILE *out;
  char *printed;
  size_t printed_size;
} fixture;

static int set_up(void **state) {
  fixture *f = calloc(1, sizeof *f);
  f->out = open_memstream(&f->printed, &f->printed_size);
  set_variable(NULL, NULL);
  *state = f;
  return 0;
}

static int tear_down(void **state) {
  fixture *f = *state;
  srv_config_deinit(&f->config);
  fclose(f->out);
  free(f->printed);
  free(f);
  return 0;
}

/* Up to four arguments. */
static srv_config_status read_flags(fixture *f, const char *const arguments[4]) {
  char *argv[6] = {(char *)(uintptr_t) "tweend"};
  int argc = 1;
  for (int i = 0; i < 4 && arguments[i] != NULL; i++) argv[argc++] = (char *)(uintptr_t)arguments[i];
  srv_config_deinit(&f->config);
  srv_config_status status = srv_config_read(&f->config, argc, argv, one_variable, f->out, &f->error);
  fflush(f->out);
  return status;
}

static void assert_bad(fixture *f, const char *first, const char *second, const char *named) {
  assert_int_equal(read_flags(f, (const char *const[4]){first, second}), SRV_CONFIG_BAD);
  if (strstr(f->error.text, named) == NULL) fail_msg("'%s' does not name %s", f->error.text, named);
  assert_null(strchr(f->error.text, '\n'));
}

TEST_WITH(bad_flags_are_named_in_one_line, set_up, tear_down) {
  fixture *f = *state;
  assert_bad(f, "--no-such", NULL, "--no-such");
  assert_bad(f, "cube.obj", NULL, "cube.obj");
  assert_bad(f, "--", NULL, "'--'");
  assert_bad(f, "--=1", NULL, "--=1");
  assert_bad(f, "--max-level", NULL, "--max-level");
  assert_bad(f, "--max-level", "99", "--max-level");
  assert_bad(f, "--max-upload", "lots", "--max-upload");
  assert_bad(f, "--max-upload=0", NULL, "--max-upload");
  assert_bad(f, "--threads", "0", "--threads");
  assert_bad(f, "--idle-timeout", "10", "--idle-timeout");
  assert_bad(f, "--log-level", "loud", "error|warn|info|debug");
  assert_bad(f, "--log-level", "", "--log-level");
  assert_bad(f, "--log-level", "@/no/such/file", "/no/such/file");
  assert_bad(f, "--sample=perhaps", NULL, "--sample");
  assert_bad(f, "--s3-style", "dns", "auto|path|virtual");
  assert_bad(f, "--data", "", "--data");
  assert_bad(f, "--tls-cert", "cert.pem", "--tls-key");
  assert_bad(f, "--spool-limit", "255MiB", "--max-upload");
  assert_bad(f, "--hosts", "tweend.example:80", "--hosts");
  assert_bad(f, "--hosts", "a.example, http://b.example", "http://b.example");
  assert_bad(f, "--hosts", "fd00::1", "--hosts");
  assert_bad(f, "--min-free", "5%", "--min-free");
}

#ifdef TWEEND_S3
TEST_WITH(an_object_store_has_no_store_limit_and_needs_a_folder, set_up, tear_down) {
  fixture *f = *state;
  assert_int_equal(read_flags(f, (const char *const[4]){"--data=s3://bucket", "--store-limit=1GiB"}),
                   SRV_CONFIG_BAD);
  assert_non_null(strstr(f->error.text, "--store-limit"));
  assert_int_equal(read_flags(f, (const char *const[4]){"--data=s3://bucket", "--cache-dir="}),
                   SRV_CONFIG_BAD);
  assert_non_null(strstr(f->error.text, "--cache-dir"));
  assert_int_equal(read_flags(f, (const char *const[4]){"--data=s3://bucket"}), SRV_CONFIG_RUN);
}
#else
TEST_WITH(a_build_without_object_stores_refuses_them, set_up, tear_down) {
  assert_bad(*state, "--data", "s3://bucket", "without object stores");
}
#endif

TEST_WITH(bad_variable_is_named, set_up, tear_down) {
  fixture *f = *state;
  set_variable("TWEEND_MAX_LEVEL", "ninety");
  assert_bad(f, NULL, NULL, "TWEEND_MAX_LEVEL");
}

TEST_WITH(defaults_are_those_of_the_documentation, set_up, tear_down) {
  fixture *f = *state;
  assert_int_equal(read_flags(f, (const char *const[4]){NULL}), SRV_CONFIG_RUN);
  assert_string_equal(f->config.listen, "127.0.0.1:8080");
  assert_string_equal(f->config.data, "./tweend-data");
  assert_int_equal(f->config.max_upload, 256u << 20);
  assert_int_equal(f->config.max_level, 10);
  assert_int_equal(f->config.max_faces, 80000000);
  assert_true(f->config.max_output == UINT64_C(4) << 30);
  assert_int_equal(f->config.max_times, 1000000);
  assert_int_equal(f->config.header_timeout, 10000);
  assert_int_equal(f->config.drain_timeout, 20000);
  assert_int_equal(f->config.queue, 4 * f->config.threads);
  assert_true(f->config.threads >= 1 && f->config.io_threads >= 1);
  assert_string_equal(f->config.cors_origins, "*");
  assert_false(f->config.sample);
}

TEST_WITH(flags_win_over_variables_and_those_over_defaults, set_up, tear_down) {
  fixture *f = *state;
  set_variable("TWEEND_MAX_LEVEL", "3");
  assert_int_equal(read_flags(f, (const char *const[4]){NULL}), SRV_CONFIG_RUN);
  assert_int_equal(f->config.max_level, 3);
  assert_int_equal(read_flags(f, (const char *const[4]){"--max-level", "5"}), SRV_CONFIG_RUN);
  assert_int_equal(f->config.max_level, 5);
  assert_int_equal(read_flags(f, (const char *const[4]){"--max-level=6"}), SRV_CONFIG_RUN);
  assert_int_equal(f->config.max_level, 6);
}

TEST_WITH(switches_are_on_when_named_and_read_words, set_up, tear_down) {
  fixture *f = *state;
  read_flags(f, (const char *const[4]){"--sample"});
  assert_true(f->config.sample);
  set_variable("TWEEND_SAMPLE", "yes");
  read_flags(f, (const char *const[4]){NULL});
  assert_true(f->config.sample);
  read_flags(f, (const char *const[4]){"--sample=false"});
  assert_false(f->config.sample);
}

TEST_WITH(queue_follows_the_threads_unless_given, set_up, tear_down) {
  fixture *f = *state;
  read_flags(f, (const char *const[4]){"--threads", "3"});
  assert_int_equal(f->config.queue, 12);
  read_flags(f, (const char *const[4]){"--threads=3", "--queue=0"});
  assert_int_equal(f->config.queue, 0);
}

static void write_file(const char *path, const char *text) {
  FILE *file = fopen(path, "w");
  assert_non_null(file);
  fputs(text, file);
  fclose(file);
}

TEST_WITH(log_level_is_a_word_or_lies_in_a_file_that_is_read_anew, set_up, tear_down) {
  fixture *f = *state;
  srv_log_level level = SRV_LOG_DEBUG;
  char path[] = "/tmp/tweend-level-XXXXXX", argument[64];
  assert_int_equal(read_flags(f, (const char *const[4]){NULL}), SRV_CONFIG_RUN);
  assert_true(srv_config_log_level(&f->config, &level, &f->error));
  assert_int_equal(level, SRV_LOG_INFO);

  close(mkstemp(path));
  write_file(path, "warn\n");
  snprintf(argument, sizeof argument, "@%s", path);
  assert_int_equal(read_flags(f, (const char *const[4]){"--log-level", argument}), SRV_CONFIG_RUN);
  assert_true(srv_config_log_level(&f->config, &level, &f->error));
  assert_int_equal(level, SRV_LOG_WARN);
  write_file(path, "error");
  assert_true(srv_config_log_level(&f->config, &level, &f->error));
  assert_int_equal(level, SRV_LOG_ERROR);
  static const char *const BAD[] = {"loud\n", "", "warn info"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
    write_file(path, BAD[i]);
    assert_false(srv_config_log_level(&f->config, &level, &f->error));
    assert_int_equal(level, SRV_LOG_ERROR);
  }
  unlink(path);
}

TEST_WITH(help_names_flags_variables_and_defaults, set_up, tear_down) {
  fixture *f = *state;
  assert_int_equal(read_flags(f, (const char *const[4]){"--max-level", "99", "--help"}), SRV_CONFIG_DONE);
  assert_non_null(strstr(f->printed, "--max-upload SIZE  (TWEEND_MAX_UPLOAD)"));
  assert_non_null(strstr(f->printed, "(default: 256MiB)"));
  assert_non_null(strstr(f->printed, "127.0.0.1:8080"));
}

TEST_WITH(version_is_one_line, set_up, tear_down) {
  fixture *f = *state;
  assert_int_equal(read_flags(f, (const char *const[4]){"--version"}), SRV_CONFIG_DONE);
  assert_string_equal(f->printed, "tweend " TWEEND_VERSION "\n");
}

TEST_WITH(unknown_flags_name_the_nearest, set_up, tear_down) {
  fixture *f = *state;
  assert_bad(f, "--max-uplaod", "1", "--max-upload");
  assert_bad(f, "--cors-origin=a", NULL, "--cors-origins");
}

TEST_WITH(origins_are_as_browsers_send_them, set_up, tear_down) {
  fixture *f = *state;
  static const char *const GOOD[] = {"*", "", "null", "https://a.example, http://localhost:3000",
                                     "app://obsidian.md"};
  for (size_t i = 0; i < sizeof GOOD / sizeof *GOOD; i++)
    assert_int_equal(read_flags(f, (const char *const[4]){"--cors-origins", GOOD[i]}), SRV_CONFIG_RUN);
  static const char *const BAD[] = {"a.example", "https://a.example/", "https://", "://a", "*,a", "**",
                                    "nullify"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++)
    assert_bad(f, "--cors-origins", BAD[i], "--cors-origins: '");
}

TEST_WITH(short_help_is_the_same, set_up, tear_down) {
  fixture *f = *state;
  assert_int_equal(read_flags(f, (const char *const[4]){"-h"}), SRV_CONFIG_DONE);
  assert_non_null(strstr(f->printed, "--rate-limit RATE"));
}

TEST_WITH(rates_have_a_count_and_a_time, set_up, tear_down) {
  fixture *f = *state;
  assert_int_equal(read_flags(f, (const char *const[4]){"--rate-limit", "100/m"}), SRV_CONFIG_RUN);
  assert_int_equal(f->config.rate_limit.count, 100);
  assert_int_equal(f->config.rate_limit.period_s, 60);
  static const char *const BAD[] = {"100",  "100/", "100/d", "100/mm",      "0/s",
                                    "-1/s", "/s",   "1.5/s", "4294967296/s"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) assert_bad(f, "--rate-limit", BAD[i], "--rate-limit");
}

/* ---- without memory -------------------------------------------------------------------------- */

static _Thread_local size_t copies_left = SIZE_MAX; /* calls of strdup until one fails; SIZE_MAX: none does */

/* The linker's --wrap gives these names.
 * NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
char *__real_strdup(const char *text);
char *__wrap_strdup(const char *text);

char *__wrap_strdup(const char *text) {
  if (copies_left == SIZE_MAX || copies_left-- > 0) return __real_strdup(text);
  return NULL;
}
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */

TEST_WITH(missing_memory_is_named_whichever_text_it_is_missing_for, set_up, tear_down) {
  fixture *f = *state;
  size_t failures = 0;
  set_variable("TWEEND_URL_KEYS", "s3cret");
  for (;; failures++) {
    copies_left = failures;
    srv_config_status status = read_flags(f, (const char *const[4]){"--api-keys", "s3cret"});
    copies_left = SIZE_MAX;
    if (status == SRV_CONFIG_RUN) break;
    assert_non_null(strstr(f->error.text, "out of memory"));
    assert_null(strstr(f->error.text, "3cret"));
  }
  assert_in_range(failures, 10, 100);
  copies_left = 0;
  char *text = srv_config_text("api-keys", "", 100, &f->error);
  copies_left = SIZE_MAX;
  assert_null(text);
  assert_string_equal(f->error.text, "--api-keys: out of memory");
}
