/* Parses Accept, Content-Type and Content-Encoding as RFC 9110 defines them. */
#include "negotiate.h"

#include <string.h>
#include <strings.h>

const char api_upload_types[] = "model/gltf-binary, model/gltf+json, model/obj, model/stl, model/ply, "
                                "model/x-bvh, text/plain, application/json, "
                                "multipart/form-data";
const char api_codings[] = "gzip, zstd";

/* ---- pieces of header values ----------------------------------------------------------------- */

static bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

static api_span trim(api_span s) {
  while (s.length > 0 && is_blank(s.text[0])) s = (api_span){s.text + 1, s.length - 1};
  while (s.length > 0 && is_blank(s.text[s.length - 1])) s.length--;
  return s;
}

api_span api_span_of(const char *text) {
  return trim((api_span){text, strlen(text)});
}

api_span api_span_cut(api_span *rest, char separator) {
  bool quoted = false;
  size_t i = 0;
  for (; i < rest->length; i++) {
    char c = rest->text[i];
    if (quoted && c == '\\' && i + 1 < rest->length) {
      i++;
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == separator && !quoted) {
      break;
    }
  }
  api_span piece = {rest->text, i};
  size_t used = i < rest->length ? i + 1 : i;
  *rest = (api_span){rest->text + used, rest->length - used};
  return trim(piece);
}

bool api_span_is(api_span s, const char *text) {
  return s.length == strlen(text) && strncasecmp(s.text, text, s.length) == 0;
}

bool api_span_starts(api_span s, const char *text) {
  return s.length >= strlen(text) && strncasecmp(s.text, text, strlen(text)) == 0;
}

/* ---- accepted and declared types ------------------------------------------------------------- */

/* The q of a media range's parameters in thousandths; 1000 without one, 0 when it is malformed. */
static int read_quality(api_span parameters) {
  while (parameters.length > 0) {
    api_span parameter = api_span_cut(&parameters, ';');
    if (!api_span_starts(parameter, "q=")) continue;
    double value;
    size_t used = tw_read_double(parameter.text + 2, parameter.length - 2, &value);
    if (used == 0 || used + 2 != parameter.length || !(value >= 0 && value <= 1)) return 0;
    return (int)(value * 1000 + 0.5);
  }
  return 1000;
}

/* How closely a media range matches a type: 3 the type itself, 2 its family, 1 anything, 0 not at all. */
static int fit(api_span range, const char *type) {
  if (api_span_is(range, type)) return 3;
  if (api_span_is(range, "*/*")) return 1;
  size_t family = strcspn(type, "/") + 1;
  bool is_family = range.length == family + 1 && range.text[family] == '*';
  return is_family && strncasecmp(range.text, type, family) == 0 ? 2 : 0;
}

static int quality_of(const char *accept, const char *type) {
  api_span rest = api_span_of(accept);
  int quality = 0, best_fit = 0;
  while (rest.length > 0) {
    api_span item = api_span_cut(&rest, ',');
    api_span range = api_span_cut(&item, ';');
    int closeness = fit(range, type);
    if (closeness == 0 || closeness < best_fit) continue;
    int q = read_quality(item);
    if (closeness > best_fit || q > quality) quality = q;
    best_fit = closeness;
  }
  return quality;
}

int api_negotiate(const char *accept, const api_offer *offers) {
  if (!accept || accept[strspn(accept, " \t")] == '\0') return 0;
  int best = -1, best_quality = 0;
  for (int i = 0; offers[i].type; i++) {
    int quality = quality_of(accept, offers[i].type);
    if (quality > best_quality) {
      best_quality = quality;
      best = i;
    }
  }
  return best;
}

/* Types and families whose content is known and is no model. All else of application/ and model/ may be a
 * model under a name unknown here. */
static bool is_foreign(api_span type) {
  static const char *const foreign[] = {"application/xml",  "application/pdf",  "application/zip",
                                        "application/gzip", "application/zstd", "application/javascript",
                                        "application/yaml"};
  for (size_t i = 0; i < sizeof foreign / sizeof *foreign; i++)
    if (api_span_is(type, foreign[i])) return true;
  bool is_xml = type.length > 4 && strncasecmp(type.text + type.length - 4, "+xml", 4) == 0;
  return is_xml || (!api_span_starts(type, "application/") && !api_span_starts(type, "model/"));
}

api_upload_type api_upload_type_of(const char *content_type) {
  if (!content_type) return API_TYPE_BYTES;
  api_span rest = api_span_of(content_type);
  api_span type = api_span_cut(&rest, ';');
  if (type.length == 0) return API_TYPE_BYTES;
  if (api_span_is(type, "model/gltf-binary")) return API_TYPE_GLB;
  if (api_span_is(type, "model/gltf+json")) return API_TYPE_GLTF;
  if (api_span_is(type, "model/obj")) return API_TYPE_OBJ;
  if (api_span_is(type, "model/stl")) return API_TYPE_STL;
  if (api_span_is(type, "model/ply")) return API_TYPE_PLY;
  if (api_span_is(type, "model/x-bvh")) return API_TYPE_BVH;
  if (api_span_is(type, "text/plain")) return API_TYPE_TEXT;
  if (api_span_is(type, "application/json")) return API_TYPE_JSON;
  if (api_span_is(type, "multipart/form-data")) return API_TYPE_MULTIPART;
  return is_foreign(type) ? API_TYPE_OTHER : API_TYPE_BYTES;
}

/* The characters that RFC 2046 allows in a boundary. */
static bool is_boundary(api_span s) {
  if (s.length == 0 || s.length > 70 || s.text[s.length - 1] == ' ') return false;
  for (size_t i = 0; i < s.length; i++) {
    char c = s.text[i];
    bool alphanumeric = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
    if (!alphanumeric && !strchr("'()+_,-./:=? ", c)) return false;
  }
  return true;
}

bool api_multipart_boundary(const char *content_type, char out[71]) {
  api_span rest = api_span_of(content_type);
  api_span_cut(&rest, ';');
  while (rest.length > 0) {
    api_span parameter = api_span_cut(&rest, ';');
    if (!api_span_starts(parameter, "boundary=")) continue;
    api_span value = {parameter.text + 9, parameter.length - 9};
    if (value.length >= 2 && value.text[0] == '"' && value.text[value.length - 1] == '"')
      value = (api_span){value.text + 1, value.length - 2};
    if (!is_boundary(value)) return false;
    memcpy(out, value.text, value.length);
    out[value.length] = '\0';
    return true;
  }
  return false;
}

api_coding api_coding_of(const char *content_encoding) {
  if (!content_encoding) return API_CODING_NONE;
  api_span coding = api_span_of(content_encoding);
  if (coding.length == 0 || api_span_is(coding, "identity")) return API_CODING_NONE;
  if (api_span_is(coding, "gzip") || api_span_is(coding, "x-gzip")) return API_CODING_GZIP;
  return api_span_is(coding, "zstd") ? API_CODING_ZSTD : API_CODING_OTHER;
}

/* The q of a coding in thousandths: its own, or that of "*"; -1 when neither is listed. */
static int coding_quality(const char *accept_encoding, const char *coding) {
  api_span rest = api_span_of(accept_encoding);
  int of_any = -1;
  while (rest.length > 0) {
    api_span item = api_span_cut(&rest, ',');
    api_span name = api_span_cut(&item, ';');
    if (api_span_is(name, coding)) return read_quality(item);
    if (api_span_is(name, "*")) of_any = read_quality(item);
  }
  return of_any;
}

api_coding api_coding_accepted(const char *accept_encoding, bool is_text) {
  if (!accept_encoding) return API_CODING_NONE;
  int identity = coding_quality(accept_encoding, "identity");
  if (!is_text && identity != 0) return API_CODING_NONE;
  int zstd = coding_quality(accept_encoding, "zstd"), gzip = coding_quality(accept_encoding, "gzip");
  int best = zstd > gzip ? zstd : gzip;
  if (best <= 0 || best < identity) return API_CODING_NONE;
  return zstd >= gzip ? API_CODING_ZSTD : API_CODING_GZIP;
}

api_coding api_coding_stored(const char *accept_encoding, bool has_brotli) {
  if (!accept_encoding) return API_CODING_NONE;
  int gzip = coding_quality(accept_encoding, "gzip");
  int brotli = has_brotli ? coding_quality(accept_encoding, "br") : -1;
  int best = brotli > gzip ? brotli : gzip;
  if (best <= 0 || best < coding_quality(accept_encoding, "identity")) return API_CODING_NONE;
  return brotli >= gzip ? API_CODING_BROTLI : API_CODING_GZIP;
}
