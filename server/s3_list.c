/* A page is XML:
 *   <ListBucketResult> <IsTruncated>true</IsTruncated> <NextContinuationToken>…</NextContinuationToken>
 *   <Contents> <Key>…</Key> <Size>…</Size> … </Contents> … </ListBucketResult> */
#include "s3_list.h"

#include <curl/curl.h>
#include <expat.h>
#include <stdlib.h>
#include <string.h>

enum { TEXT_SIZE = 2048, QUERY_SIZE = 3 * TEXT_SIZE };

typedef struct page {
  bool is_broken;
  bool is_in_contents;
  char text[TEXT_SIZE]; /* text of the open element */
  size_t text_size;
  char key[TEXT_SIZE];
  uint64_t size;
  char token[TEXT_SIZE]; /* continuation token of the next page, "" without one */
  bool is_truncated;
  const char *prefix; /* of all keys; passed keys come without it */
  bool is_done;       /* `take` has returned false */
  bool (*take)(void *context, const char *key, uint64_t size);
  void *context;
} page;

static void XMLCALL begin_element(void *context, const char *name, const char **attributes) {
  page *p = context;
  (void)attributes;
  p->text_size = 0;
  if (strcmp(name, "Contents") == 0) {
    p->is_in_contents = true;
    p->key[0] = '\0';
    p->size = 0;
  }
}

static void XMLCALL take_text(void *context, const char *text, int size) {
  page *p = context;
  if ((size_t)size >= sizeof p->text - p->text_size) {
    p->is_broken = true;
    return;
  }
  memcpy(p->text + p->text_size, text, (size_t)size);
  p->text_size += (size_t)size;
}

static void XMLCALL end_element(void *context, const char *name) {
  page *p = context;
  p->text[p->text_size] = '\0';
  if (strcmp(name, "Contents") == 0) {
    size_t prefix_size = strlen(p->prefix);
    bool is_ours = strncmp(p->key, p->prefix, prefix_size) == 0;
    if (is_ours && !p->is_done) p->is_done = !p->take(p->context, p->key + prefix_size, p->size);
    p->is_in_contents = false;
  } else if (p->is_in_contents && strcmp(name, "Key") == 0) {
    memcpy(p->key, p->text, p->text_size + 1);
  } else if (p->is_in_contents && strcmp(name, "Size") == 0) {
    p->size = strtoull(p->text, NULL, 10);
  } else if (strcmp(name, "NextContinuationToken") == 0) {
    memcpy(p->token, p->text, p->text_size + 1);
  } else if (strcmp(name, "IsTruncated") == 0) {
    p->is_truncated = strcmp(p->text, "true") == 0;
  }
  p->text_size = 0;
}

/* The text of a page, complete before it is parsed: a download that breaks off may be repeated. */
typedef struct document {
  char *data;
  size_t size, capacity;
} document;

static bool collect(void *context, uint64_t offset, const uint8_t *data, size_t size) {
  static const size_t MOST = 16 << 20;
  document *d = context;
  if (offset == 0) d->size = 0;
  if (size > MOST - d->size) return false;
  if (d->size + size > d->capacity) {
    size_t capacity = 2 * (d->size + size);
    char *longer = realloc(d->data, capacity);
    if (!longer) return false;
    d->data = longer;
    d->capacity = capacity;
  }
  memcpy(d->data + d->size, data, size);
  d->size += size;
  return true;
}

/* Parses a page; false when the text is not one. */
static bool read_page(page *p, const document *d) {
  XML_Parser parser = XML_ParserCreate(NULL);
  if (!parser) return false;
  XML_SetUserData(parser, p);
  XML_SetElementHandler(parser, begin_element, end_element);
  XML_SetCharacterDataHandler(parser, take_text);
  bool is_read = XML_Parse(parser, d->data, (int)d->size, XML_TRUE) == XML_STATUS_OK && !p->is_broken;
  XML_ParserFree(parser);
  return is_read;
}

/* Appends NAME=VALUE, with `prefix` before the value and both percent-encoded. Call with ascending names: the
 * signature needs a sorted query. */
static bool add_argument(char query[QUERY_SIZE], const char *name, const char *prefix, const char *value) {
  char whole[2 * TEXT_SIZE];
  snprintf(whole, sizeof whole, "%s%s", prefix, value);
  char *encoded = curl_easy_escape(NULL, whole, 0);
  size_t size = strlen(query);
  int added = !encoded
                  ? -1
                  : snprintf(query + size, QUERY_SIZE - size, "%s%s=%s", size > 0 ? "&" : "", name, encoded);
  curl_free(encoded);
  return added >= 0 && (size_t)added < QUERY_SIZE - size;
}

/* The query for one page: the page of the token or, without a token, the one after the key `after`. */
static bool make_query(const page *p, const char *folder, const char *after, unsigned page_size,
                       char query[QUERY_SIZE]) {
  char count[16];
  snprintf(count, sizeof count, "%u", page_size);
  query[0] = '\0';
  bool goes_on = p->token[0] != '\0';
  return (!goes_on || add_argument(query, "continuation-token", "", p->token)) &&
         add_argument(query, "list-type", "", "2") && add_argument(query, "max-keys", "", count) &&
         add_argument(query, "prefix", p->prefix, folder) &&
         (goes_on || after[0] == '\0' || add_argument(query, "start-after", p->prefix, after));
}

static void fail(srv_s3_answer *answer, const char *reason) {
  answer->status = 0;
  srv_fail(&answer->reason, "%s", reason);
}

void srv_s3_list(srv_s3 *s3, const char *folder, const char *after, unsigned page_size, uint64_t timeout_ms,
                 const atomic_bool *stops, bool (*take)(void *context, const char *key, uint64_t size),
                 void *context, srv_s3_answer *answer) {
  page p = {.prefix = srv_s3_prefix(s3), .take = take, .context = context};
  document d = {0};
  do {
    char query[QUERY_SIZE];
    if (!make_query(&p, folder, after, page_size, query)) {
      fail(answer, "out of memory");
      break;
    }
    d.size = 0; /* `collect` is not called for an empty answer */
    p.is_truncated = false;
    p.token[0] = '\0';
    const srv_s3_request request = {.method = SRV_S3_GET,
                                    .query = query,
                                    .timeout_ms = timeout_ms,
                                    .stops = stops,
                                    .take = collect,
                                    .context = &d};
    srv_s3_send(s3, &request, answer);
    free(answer->summary);
    answer->summary = NULL;
    if (answer->status == 200 && !read_page(&p, &d)) fail(answer, "the listing is not what S3 stores answer");
  } while (answer->status == 200 && p.is_truncated && p.token[0] != '\0' && !p.is_done);
  free(d.data);
}
