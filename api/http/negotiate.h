/* Content negotiation: what a client accepts and what it declares to send; and parsing of header values:
 * lists, parameters, quoted strings (RFC 9110, section 5.6). */
#ifndef API_NEGOTIATE_H
#define API_NEGOTIATE_H

#include "tweend/base.h"

/* One representation that a route can answer with. */
typedef struct api_offer {
  const char *extension; /* "glb"; "" where the route has no extensions */
  const char *type;      /* media type, without parameters */
  bool is_text;          /* compresses well */
} api_offer;

/* The index of the offer that an Accept header (RFC 9110, section 12.5.1; NULL: anything) prefers, the first
 * of equals; -1 when it accepts none. offers: ends with a NULL type. */
int api_negotiate(const char *accept, const api_offer *offers);

/* The declared type of an upload. */
typedef enum api_upload_type {
  API_TYPE_BYTES, /* the bytes decide */
  API_TYPE_GLB,
  API_TYPE_GLTF,
  API_TYPE_OBJ,
  API_TYPE_STL,
  API_TYPE_PLY,
  API_TYPE_BVH,
  API_TYPE_TEXT, /* OBJ, or another format that is text */
  API_TYPE_JSON,
  API_TYPE_MULTIPART,
  API_TYPE_OTHER /* certainly no model: an image, a web page */
} api_upload_type;

/* The type in a Content-Type header; NULL: absent. */
api_upload_type api_upload_type_of(const char *content_type);

/* The unquoted boundary parameter of a multipart Content-Type: at most 70 characters (RFC 2046) and a
 * terminator into out. False when there is none. */
bool api_multipart_boundary(const char *content_type, char out[71]);

typedef enum api_coding {
  API_CODING_NONE,
  API_CODING_GZIP,
  API_CODING_ZSTD,
  API_CODING_BROTLI, /* of stored pages alone */
  API_CODING_OTHER
} api_coding;

/* The coding in a Content-Encoding header; NULL: absent. Several codings count as API_CODING_OTHER. */
api_coding api_coding_of(const char *content_encoding);

/* The coding of an answer for an Accept-Encoding (RFC 9110, section 12.5.3; NULL: none). A text is encoded if
 * the client accepts that, other content only if the client refuses it unencoded. */
api_coding api_coding_accepted(const char *accept_encoding, bool is_text);

/* Which form of a page that is stored by gzip, and maybe by brotli, an Accept-Encoding prefers: brotli of
 * equals; API_CODING_NONE if it takes none of them, or rather the plain bytes. */
api_coding api_coding_stored(const char *accept_encoding, bool has_brotli);

/* A view, not terminated. */
typedef struct api_span {
  const char *text;
  size_t length;
} api_span;

/* A span of terminated text, without blanks around it. */
api_span api_span_of(const char *text);

/* Cuts off and returns the text before the next `separator` outside quotes, without blanks around it; *rest
 * moves behind the separator. */
api_span api_span_cut(api_span *rest, char separator);

/* Whether the span equals, or begins with, a text, ignoring case. */
bool api_span_is(api_span s, const char *text);
bool api_span_starts(api_span s, const char *text);

extern const char api_upload_types[]; /* the types of models, comma-separated */
extern const char api_codings[];      /* the content codings, comma-separated */

#endif
