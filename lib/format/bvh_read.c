/* BVH, Biovision's motion capture text: a hierarchy of joints with offsets and channels, then a line of
 * numbers a frame. A joint becomes a node, its rotation channels an Euler track in their own order, its
 * position channels a translation track. Two passes over the frames: one counts the numbers, so that each
 * track is allocated once; the other stores each number where it stays. Source: M. Meredith and S. Maddock,
 * Motion Capture File Formats Explained, 2001, section 3. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "array.h"
#include "bvh.h"
#include "losses.h"
#include "obj_text.h"
#include "quat.h"
#include "tweend/format.h"
#include "word.h"

enum {
  END_SUFFIX = 4,        /* bytes of "_end" */
  NUMBER_MOST = 1024,    /* characters of a number; printf needs 317 for the largest double */
  FRAMES_MOST = 1 << 23, /* up to here the times of frames differ in single precision */
  NUMBERS_A_STEP = 8192, /* between two calls of tw_work */
  CLAIM_ROOM = 1000,     /* frames that a file may lack, however short it is */
  BYTES_A_NUMBER = 2     /* the fewest that a number of a frame takes: a digit and a blank */
};

typedef enum bvh_kind { BVH_POSITION, BVH_ROTATION, BVH_SCALE, BVH_KINDS } bvh_kind;
static const char *const kind_words[BVH_KINDS] = {"position", "rotation", "scale"};

typedef struct bvh_channel {
  uint32_t joint;
  uint8_t kind, axis; /* bvh_kind; 0 to 2 */
} bvh_channel;

typedef struct bvh_joint {
  tw_word name;
  uint32_t parent; /* TW_NO_INDEX for a root */
  float offset[3];
  uint8_t axes[BVH_KINDS][3], counts[BVH_KINDS]; /* the axes of its channels, in their order */
  bool is_end, has_offset, has_channels, has_child, has_end;
} bvh_joint;

/* A file on its way to a model. */
typedef struct bvh_file {
  const char *at, *end;
  uint64_t line; /* of `at`, from 1 */
  bvh_joint *joints;
  bvh_channel *channels;
  uint32_t joint_count, channel_count;
  size_t joint_room, channel_room;
  uint32_t open;     /* the joint whose block is open, or TW_NO_INDEX */
  double claimed;    /* what Frames: says */
  double frame_time; /* seconds */
  bool has_motion;
  tw_losses losses;
  tw_error *error;
} bvh_file;

/* ---- text ------------------------------------------------------------------------------------ */

/* Control characters are blanks too: files may end with a zero byte or Ctrl-Z. */
static inline bool is_blank(char c) {
  return (unsigned char)c <= ' ';
}

static inline bool is_line_end(char c) {
  return c == '\n' || c == '\r';
}

/* Moves over one blank, and counts the line that it ends: LF, CRLF or a lone CR. */
static inline void skip_blank(bvh_file *file) {
  char c = *file->at++;
  file->line += c == '\n' || (c == '\r' && !(file->at < file->end && *file->at == '\n'));
}

static inline void skip_blanks(bvh_file *file) {
  while (file->at < file->end && is_blank(*file->at)) skip_blank(file);
}

static inline void skip_in_line(bvh_file *file) {
  while (file->at < file->end && is_blank(*file->at) && !is_line_end(*file->at)) file->at++;
}

/* Reads the next word; a brace is a word. Length 0 at the end. */
static tw_word next_word(bvh_file *file) {
  skip_blanks(file);
  const char *start = file->at;
  while (file->at < file->end && !is_blank(*file->at) && *file->at != '{' && *file->at != '}') file->at++;
  if (file->at == start && file->at < file->end) file->at++;
  return (tw_word){start, (size_t)(file->at - start)};
}

/* Reads a name, which goes to the end of the line or to a brace. */
static tw_word read_name(bvh_file *file) {
  skip_in_line(file);
  const char *start = file->at;
  while (file->at < file->end && !is_line_end(*file->at) && *file->at != '{') file->at++;
  const char *end = file->at;
  while (end > start && is_blank(end[-1])) end--;
  return (tw_word){start, (size_t)(end - start)};
}

/* Compares without regard to case. keyword: in lower case. */
static bool word_is(tw_word word, const char *keyword) {
  return word.length == strlen(keyword) && tw_word_begins(word, keyword);
}

static tw_status fail_number(bvh_file *file, tw_word word) {
  if (word.length == 0) return tw_fail_line(file->error, TW_SYNTAX, file->line, "a number is missing");
  if (word.length > NUMBER_MOST)
    return tw_fail_line(file->error, TW_SYNTAX, file->line, "a number has at most %d characters",
                        NUMBER_MOST);
  return tw_fail_line(file->error, TW_SYNTAX, file->line, "\"%s\" is no number",
                      tw_obj_quote_word(word).text);
}

/* Reads a number that is written with a comma before its decimals, or behind it. */
static bool read_with_comma(bvh_file *file, tw_word word, double *out) {
  char text[NUMBER_MOST];
  const char *comma = memchr(word.text, ',', word.length);
  if (!comma) return false;
  tw_lose(&file->losses, "number has a comma: it is read as the decimal point",
          "numbers have a comma: it is read as the decimal point", comma + 1 < word.text + word.length,
          file->line);
  memcpy(text, word.text, word.length);
  text[comma - word.text] = '.';
  return tw_word_number((tw_word){text, word.length}, out);
}

static tw_status take_number(bvh_file *file, tw_word word, double *out) {
  bool is_number = word.length > 0 && word.length <= NUMBER_MOST &&
                   (tw_word_number(word, out) || read_with_comma(file, word, out));
  if (!is_number) return fail_number(file, word);
  if (isfinite(*out)) return TW_OK;
  return tw_fail_line(file->error, TW_INVALID, file->line, "a number is not finite");
}

/* Reads the number that begins at `at`, up to a blank. */
static inline tw_status read_number(bvh_file *file, double *out) {
  size_t left = (size_t)(file->end - file->at), used = tw_read_plain(file->at, left, out);
  if (used > 0 && (used == left || is_blank(file->at[used]))) {
    file->at += used;
    return TW_OK;
  }
  tw_word word = next_word(file);
  return take_number(file, word, out);
}

static tw_status fail_float(bvh_file *file) {
  return tw_fail_line(file->error, TW_INVALID, file->line, "a number is no finite 32-bit float");
}

/* ---- the hierarchy --------------------------------------------------------------------------- */

/* Adds a joint and opens its block. */
static tw_status open_joint(bvh_file *file, tw_word name, bool is_end) {
  bvh_joint *parent = file->open == TW_NO_INDEX ? NULL : &file->joints[file->open];
  if (is_end && !parent) return tw_fail_line(file->error, TW_SYNTAX, file->line, "an End Site has no joint");
  if (parent && parent->is_end)
    return tw_fail_line(file->error, TW_SYNTAX, file->line, "a joint stands in an End Site");
  if (name.length > TW_NAME_MAX)
    return tw_fail_line(file->error, TW_INVALID, file->line, "the name of a joint has at most %d bytes",
                        TW_NAME_MAX);
  if (file->joint_count == TW_NODES_MAX)
    return tw_fail_line(file->error, TW_LIMIT, file->line, "there are more than %d joints", TW_NODES_MAX);
  uint64_t line = file->line;
  if (!word_is(next_word(file), "{"))
    return tw_fail_line(file->error, TW_SYNTAX, line, "{ is missing behind the name of a joint");
  bool is_named =
      !is_end || !parent->has_end; /* names of a thousand end sites would take a thousand times as much */
  if (parent) parent->has_child = true;
  if (parent && is_end) parent->has_end = true;
  tw_lose(&file->losses, "name of an end site is left out: it is named after its joint",
          "names of end sites are left out: they are named after their joints", is_end && name.length > 0,
          line);
  bvh_joint *joints = tw_array_grow(file->joints, file->joint_count, sizeof *joints, &file->joint_room);
  if (!joints) return tw_fail(file->error, TW_NO_MEMORY, "out of memory");
  file->joints = joints;
  if (is_end) name = is_named ? file->joints[file->open].name : (tw_word){name.text, 0};
  file->joints[file->joint_count] = (bvh_joint){.name = name, .parent = file->open, .is_end = is_end};
  file->open = file->joint_count++;
  return TW_OK;
}

static tw_status read_offset(bvh_file *file) {
  bvh_joint *joint = &file->joints[file->open];
  tw_lose(&file->losses, "OFFSET takes the place of one before it in its joint",
          "OFFSETs take the place of others before them in their joints", joint->has_offset, file->line);
  joint->has_offset = true;
  for (int i = 0; i < 3; i++) {
    double value;
    tw_status status = take_number(file, next_word(file), &value);
    if (status != TW_OK) return status;
    joint->offset[i] = (float)value;
    if (!isfinite(joint->offset[i])) return fail_float(file);
  }
  return TW_OK;
}

/* Reads the name of a channel, such as Xrotation. */
static bool parse_channel(tw_word word, bvh_channel *out) {
  if (word.length == 0 || (word.text[0] | 0x20) < 'x' || (word.text[0] | 0x20) > 'z') return false;
  out->axis = (uint8_t)((word.text[0] | 0x20) - 'x');
  for (int kind = 0; kind < BVH_KINDS; kind++) {
    out->kind = (uint8_t)kind;
    if (word_is((tw_word){word.text + 1, word.length - 1}, kind_words[kind])) return true;
  }
  return false;
}

/* told: the number behind CHANNELS. */
static tw_status add_channel(bvh_file *file, tw_word word, double told) {
  bvh_channel channel = {.joint = file->open};
  if (!parse_channel(word, &channel))
    return tw_fail_line(file->error, TW_SYNTAX, file->line,
                        "\"%s\" is no channel, of which CHANNELS says %.0f", tw_obj_quote_word(word).text,
                        told);
  bvh_joint *joint = &file->joints[file->open];
  uint8_t *count = &joint->counts[channel.kind];
  for (int i = 0; i < *count; i++)
    if (joint->axes[channel.kind][i] == channel.axis)
      return tw_fail_line(file->error, channel.kind == BVH_ROTATION ? TW_UNSUPPORTED : TW_INVALID, file->line,
                          "a joint has two channels %s", tw_obj_quote_word(word).text);
  joint->axes[channel.kind][(*count)++] = channel.axis;
  bvh_channel *channels =
      tw_array_grow(file->channels, file->channel_count, sizeof *channels, &file->channel_room);
  if (!channels) return tw_fail(file->error, TW_NO_MEMORY, "out of memory");
  channels[file->channel_count++] = channel;
  file->channels = channels;
  return TW_OK;
}

static tw_status read_channels(bvh_file *file) {
  bvh_joint *joint = &file->joints[file->open];
  double count;
  if (joint->has_channels || joint->has_child)
    return tw_fail_line(file->error, TW_SYNTAX, file->line, "%s",
                        joint->has_child ? "CHANNELS stand before the joints within"
                                         : "a joint has CHANNELS twice");
  joint->has_channels = true;
  tw_status status = take_number(file, next_word(file), &count);
  if (status == TW_OK && !(count >= 0 && count == floor(count)))
    status = tw_fail_line(file->error, TW_SYNTAX, file->line, "CHANNELS needs their number");
  if (status == TW_OK && joint->is_end && count > 0)
    status = tw_fail_line(file->error, TW_SYNTAX, file->line, "an End Site has no channels");
  uint32_t channels = status == TW_OK && count < UINT32_MAX ? (uint32_t)count : UINT32_MAX;
  for (uint32_t i = 0; i < channels && status == TW_OK; i++)
    status = add_channel(file, next_word(file), count);
  return status;
}

/* Reads what begins with a word inside of HIERARCHY. */
static tw_status read_statement(bvh_file *file, tw_word word) {
  bool is_open = file->open != TW_NO_INDEX;
  if (word_is(word, "root") || word_is(word, "joint")) return open_joint(file, read_name(file), false);
  if (word_is(word, "end")) {
    if (!word_is(next_word(file), "site"))
      return tw_fail_line(file->error, TW_SYNTAX, file->line, "End needs Site behind it");
    return open_joint(file, read_name(file), true);
  }
  bool is_brace = word_is(word, "}"), is_offset = word_is(word, "offset"),
       is_channels = word_is(word, "channels");
  bvh_channel channel;
  if (parse_channel(word, &channel))
    return tw_fail_line(file->error, TW_SYNTAX, file->line, "\"%s\" is more than CHANNELS says",
                        tw_obj_quote_word(word).text);
  if (!is_brace && !is_offset && !is_channels)
    return tw_fail_line(file->error, TW_SYNTAX, file->line, "\"%s\" is out of place",
                        tw_obj_quote_word(word).text);
  if (!is_open)
    return tw_fail_line(file->error, TW_SYNTAX, file->line, "%s stands in no joint",
                        is_brace    ? "}"
                        : is_offset ? "OFFSET"
                                    : "CHANNELS");
  if (is_offset) return read_offset(file);
  if (is_channels) return read_channels(file);
  file->open = file->joints[file->open].parent;
  return TW_OK;
}

/* Reads from behind the first word up to MOTION or the end. */
static tw_status read_hierarchy(bvh_file *file) {
  tw_status status = TW_OK;
  file->open = TW_NO_INDEX;
  for (uint64_t words = 1; status == TW_OK; words++) {
    tw_word word = next_word(file);
    file->has_motion = word_is(word, "motion");
    if (word.length == 0 || file->has_motion) break;
    status = words % NUMBERS_A_STEP == 0 && !tw_work(NUMBERS_A_STEP) ? tw_work_status(file->error)
                                                                     : read_statement(file, word);
  }
  if (status == TW_OK && file->open != TW_NO_INDEX)
    status = tw_fail_line(file->error, TW_SYNTAX, file->line, "the block of a joint is not closed");
  if (status == TW_OK && file->joint_count == 0)
    status = tw_fail_line(file->error, TW_SYNTAX, file->line, "there is no ROOT");
  return status;
}

/* ---- the head of the motion ------------------------------------------------------------------ */

/* Reads a word of the head; colons are blanks there. */
static tw_word next_head_word(bvh_file *file) {
  for (skip_blanks(file); file->at < file->end && *file->at == ':'; skip_blanks(file)) file->at++;
  const char *start = file->at;
  while (file->at < file->end && !is_blank(*file->at) && *file->at != ':') file->at++;
  return (tw_word){start, (size_t)(file->at - start)};
}

/* Reads the number of a member, which stands in the member's line: the next line may be a frame. */
static tw_status read_head_number(bvh_file *file, const char *member, double *out) {
  skip_in_line(file);
  while (file->at < file->end && *file->at == ':') {
    file->at++;
    skip_in_line(file);
  }
  if (file->at == file->end || is_line_end(*file->at))
    return tw_fail_line(file->error, TW_SYNTAX, file->line, "%s has no number", member);
  return take_number(file, next_head_word(file), out);
}

static tw_status check_frame_time(bvh_file *file) {
  if (file->frame_time >= (double)FLT_MIN && file->frame_time * FRAMES_MOST <= (double)FLT_MAX) return TW_OK;
  if (file->frame_time == 0) return TW_OK; /* enough for a single frame */
  return tw_fail_line(file->error, TW_INVALID, file->line, "Frame Time is no time in seconds");
}

/* Reads Frames and Frame Time, in either order. */
static tw_status read_head(bvh_file *file) {
  bool has_frames = false, has_time = false;
  tw_status status = TW_OK;
  while (status == TW_OK && !(has_frames && has_time)) {
    tw_word word = next_head_word(file);
    bool is_time = word_is(word, "frametime"), is_frame = word_is(word, "frame");
    if (is_frame && !word_is(next_head_word(file), "time")) is_frame = false, word.length = 0;
    if (word_is(word, "frames") && !has_frames) {
      status = read_head_number(file, "Frames:", &file->claimed);
      if (status == TW_OK && !(file->claimed >= 0 && file->claimed == floor(file->claimed)))
        status = tw_fail_line(file->error, TW_SYNTAX, file->line, "Frames is no number of frames");
      has_frames = true;
    } else if ((is_time || is_frame) && !has_time) {
      status = read_head_number(file, "Frame Time:", &file->frame_time);
      if (status == TW_OK) status = check_frame_time(file);
      has_time = true;
    } else {
      status = tw_fail_line(file->error, TW_SYNTAX, file->line, "%s is missing behind MOTION",
                            has_frames ? "Frame Time:" : "Frames:");
    }
  }
  return status;
}

/* ---- frames ---------------------------------------------------------------------------------- */

/* Where the numbers of a channel go: one a frame, three apart. Both NULL: nowhere. */
typedef struct bvh_place {
  double *angle;
  float *position;
} bvh_place;

/* What becomes of the frames. */
typedef struct bvh_motion {
  uint32_t frame_count;
  uint64_t rest; /* numbers behind the last whole frame */
  tw_track_keys *tracks;
  uint32_t track_count;
  float *times;
  bvh_place *places; /* [channel_count] */
} bvh_motion;

static uint64_t count_words(const char *text, const char *end) {
  uint64_t count = 0;
  unsigned char before = ' ';
  for (; text < end; text++) {
    unsigned char c = (unsigned char)*text;
    count += (uint64_t)((c > ' ') & (before <= ' '));
    before = c;
  }
  return count;
}

/* Finds how many frames there are. */
static tw_status count_frames(bvh_file *file, bvh_motion *out) {
  skip_blanks(file);
  uint64_t left = (uint64_t)(file->end - file->at), numbers = left / BYTES_A_NUMBER + 1;
  if ((file->claimed - CLAIM_ROOM) * (double)file->channel_count > (double)numbers)
    return tw_fail_line(file->error, TW_INVALID, file->line,
                        "Frames: %.0f are more than the rest of the file can hold", file->claimed);
  if (!tw_work(left / 8)) return tw_work_status(file->error);
  uint64_t words = count_words(file->at, file->end);
  if (file->channel_count == 0 && words > 0)
    return tw_fail_line(file->error, TW_SYNTAX, file->line, "there are frames, and no joint has channels");
  uint64_t frames = file->channel_count > 0 ? words / file->channel_count : 0;
  if (frames > FRAMES_MOST)
    return tw_fail_line(file->error, TW_LIMIT, file->line, "there are more than %d frames", FRAMES_MOST);
  if (frames > 1 && file->frame_time == 0)
    return tw_fail_line(file->error, TW_INVALID, file->line,
                        "Frame Time is 0, so all frames are at one time");
  out->frame_count = (uint32_t)frames;
  out->rest = words - frames * file->channel_count;
  return TW_OK;
}

/* The first order whose axes begin with those of the channels. */
static tw_euler_order order_of(const bvh_joint *joint) {
  int order = 0;
  while (memcmp(tw_euler_axes[order], joint->axes[BVH_ROTATION], joint->counts[BVH_ROTATION]) != 0) order++;
  return (tw_euler_order)order;
}

static tw_track_keys rotation_track(const bvh_joint *joint, double *angles) {
  return (tw_track_keys){.path = TW_ROTATION,
                         .interpolation = TW_EULER,
                         .form = TW_KEY_EULER,
                         .order = order_of(joint),
                         .width = 3,
                         .angles = angles};
}

static tw_track_keys translation_track(const float *values) {
  return (tw_track_keys){.path = TW_TRANSLATION,
                         .interpolation = TW_LINEAR,
                         .form = TW_KEY_VALUES,
                         .width = 3,
                         .values = values};
}

/* Adds the tracks of a joint, and tells its channels where their numbers go. */
static bool add_tracks(const bvh_file *file, uint32_t index, tw_arena *arena, uint32_t *channel,
                       bvh_motion *motion) {
  const bvh_joint *joint = &file->joints[index];
  uint32_t frames = motion->frame_count;
  int rotations = joint->counts[BVH_ROTATION], positions = joint->counts[BVH_POSITION];
  size_t angle_size = 3 * sizeof(double);
  double *angles = rotations == 3 ? tw_arena_alloc_raw(arena, frames, angle_size)
                   : rotations    ? tw_arena_alloc(arena, frames, angle_size)
                                  : NULL;
  float *values = positions ? tw_arena_alloc_raw(arena, frames, 3 * sizeof *values) : NULL;
  if ((rotations && !angles) || (positions && !values)) return false;
  uint32_t first = motion->track_count;
  if (positions) motion->tracks[motion->track_count++] = translation_track(values);
  if (rotations) motion->tracks[motion->track_count++] = rotation_track(joint, angles);
  for (uint32_t i = first; i < motion->track_count; i++) {
    motion->tracks[i].node = index;
    motion->tracks[i].key_count = frames;
    motion->tracks[i].times = motion->times;
  }
  for (uint32_t f = 0; positions && positions < 3 && f < frames; f++)
    memcpy(values + 3 * (size_t)f, joint->offset, sizeof joint->offset);
  for (; *channel < file->channel_count && file->channels[*channel].joint == index; ++*channel) {
    const bvh_channel *c = &file->channels[*channel];
    motion->places[*channel] = (bvh_place){.angle = c->kind == BVH_ROTATION ? angles + c->axis : NULL,
                                           .position = c->kind == BVH_POSITION ? values + c->axis : NULL};
  }
  return true;
}

/* Refuses keys beyond what reading may take: joints with one rotation channel store three angles a frame. */
static tw_status check_size(bvh_file *file, const bvh_motion *motion, size_t file_size) {
  uint64_t each = sizeof(float);
  for (uint32_t i = 0; i < file->joint_count; i++) {
    const bvh_joint *joint = &file->joints[i];
    each += (joint->counts[BVH_ROTATION] ? 3 * sizeof(double) : 0) +
            (joint->counts[BVH_POSITION] ? 3 * sizeof(float) : 0);
  }
  uint64_t most = tw_reading_size(TW_FORMAT_BVH, file_size) - file_size;
  if (motion->frame_count == 0 || each <= most / motion->frame_count) return TW_OK;
  return tw_fail(file->error, TW_LIMIT,
                 "the keys of %u %s take %llu bytes each, too much for a file of %llu bytes",
                 motion->frame_count, tw_plural(motion->frame_count, "frame", "frames"),
                 (unsigned long long)each, (unsigned long long)file_size);
}

static tw_status make_room(bvh_file *file, tw_arena *arena, bvh_motion *motion) {
  motion->tracks = tw_arena_alloc_raw(arena, 2 * (size_t)file->joint_count, sizeof *motion->tracks);
  motion->times = tw_arena_alloc_raw(arena, motion->frame_count, sizeof *motion->times);
  motion->places = tw_alloc(file->channel_count, sizeof *motion->places);
  bool has_room = motion->tracks && motion->times && motion->places;
  uint32_t channel = 0;
  for (uint32_t i = 0; has_room && i < file->joint_count; i++)
    has_room = add_tracks(file, i, arena, &channel, motion);
  if (!has_room) return tw_fail(file->error, TW_NO_MEMORY, "out of memory");
  for (uint32_t f = 0; f < motion->frame_count; f++) motion->times[f] = (float)(f * file->frame_time);
  return TW_OK;
}

/* Stores a number of a frame. */
static inline tw_status store(bvh_file *file, const bvh_place *place, uint32_t frame, double value) {
  static const double ANGLE_MOST = 1e9; /* degrees; tw_clip_create takes as many radians */
  if (place->angle) {
    if (!(fabs(value) <= ANGLE_MOST))
      return tw_fail_line(file->error, TW_INVALID, file->line, "an angle is beyond 1e9 degrees");
    place->angle[3 * (size_t)frame] = value / TW_DEGREES;
  } else if (place->position) {
    float position = (float)value;
    if (!isfinite(position)) return fail_float(file);
    place->position[3 * (size_t)frame] = position;
  }
  return TW_OK;
}

/* Reads `count` numbers. */
static tw_status read_numbers(bvh_file *file, const bvh_motion *motion, uint32_t frame, uint32_t count) {
  static const bvh_place nowhere = {NULL, NULL};
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < count && status == TW_OK; i++) {
    double value = 0;
    skip_blanks(file);
    status = read_number(file, &value);
    if (status == TW_OK)
      status = store(file, frame < motion->frame_count ? &motion->places[i] : &nowhere, frame, value);
    if (i % NUMBERS_A_STEP == NUMBERS_A_STEP - 1 && status == TW_OK && !tw_work(NUMBERS_A_STEP))
      status = tw_work_status(file->error);
  }
  return status;
}

/* A frame ends with a line. It may take several, but a number too few or too many shows. */
static tw_status end_frame(bvh_file *file, uint32_t frame) {
  skip_in_line(file);
  if (file->at == file->end || is_line_end(*file->at)) return TW_OK;
  return tw_fail_line(file->error, TW_SYNTAX, file->line,
                      "frame %u does not end with this line: a frame has %u %s", frame, file->channel_count,
                      tw_plural(file->channel_count, "number", "numbers"));
}

static tw_status read_frames(bvh_file *file, const bvh_motion *motion) {
  tw_status status = TW_OK;
  uint64_t numbers = 0;
  for (uint32_t f = 0; f < motion->frame_count && status == TW_OK; f++) {
    status = read_numbers(file, motion, f, file->channel_count);
    if (status == TW_OK) status = end_frame(file, f);
    numbers += file->channel_count;
    if (numbers < NUMBERS_A_STEP || status != TW_OK) continue;
    if (!tw_work(numbers)) status = tw_work_status(file->error);
    numbers = 0;
  }
  return status == TW_OK ? read_numbers(file, motion, motion->frame_count, (uint32_t)motion->rest) : status;
}

static tw_status read_motion(bvh_file *file, size_t size, tw_model *model) {
  bvh_motion motion = {0};
  tw_status status = read_head(file);
  if (status == TW_OK) status = count_frames(file, &motion);
  if (status == TW_OK) status = check_size(file, &motion, size);
  if (status == TW_OK) status = make_room(file, model->arena, &motion);
  if (status == TW_OK) status = read_frames(file, &motion);
  tw_free(motion.places);
  if (status != TW_OK) return status;
  if (motion.frame_count != file->claimed)
    tw_model_warn(model, "Frames: says %.0f, and there %s %u", file->claimed,
                  tw_plural(motion.frame_count, "is", "are"), motion.frame_count);
  if (motion.rest > 0)
    tw_model_warn(model, "the last frame is left out: it has %llu of %u %s", (unsigned long long)motion.rest,
                  file->channel_count, tw_plural(file->channel_count, "number", "numbers"));
  if (motion.frame_count == 0 && file->claimed == 0 && motion.rest == 0)
    tw_model_warn(model, "MOTION has no frame, and so there is no clip");
  if (motion.frame_count == 0 || motion.track_count == 0) return TW_OK;
  model->clips = tw_arena_alloc(model->arena, 1, sizeof *model->clips);
  if (!model->clips) return tw_fail(file->error, TW_NO_MEMORY, "out of memory");
  model->clips[0] =
      (tw_clip_keys){.name = "motion", .track_count = motion.track_count, .tracks = motion.tracks};
  model->clip_count = 1;
  return TW_OK;
}

/* ---- the model ------------------------------------------------------------------------------- */

/* The name of a joint's node. An end site's is its parent's with _end, or none where that is too long. */
static tw_status name_node(bvh_file *file, const bvh_joint *joint, tw_arena *arena, const char **out) {
  *out = NULL;
  if (joint->name.length == 0) return TW_OK;
  char text[TW_NAME_MAX + END_SUFFIX];
  size_t length = joint->name.length;
  memcpy(text, joint->name.text, length);
  if (joint->is_end) memcpy(text + length, "_end", END_SUFFIX);
  *out = joint->is_end ? tw_arena_name(arena, text, length + END_SUFFIX)
                       : tw_take_name(&file->losses, arena, text, length);
  if (!*out) return tw_fail(file->error, TW_NO_MEMORY, "out of memory");
  if (strlen(*out) <= TW_NAME_MAX) return TW_OK;
  *out = NULL;
  if (joint->is_end) return TW_OK;
  return tw_fail(file->error, TW_INVALID, "the name of a joint has at most %d bytes, as UTF-8 as well",
                 TW_NAME_MAX);
}

static tw_status make_nodes(bvh_file *file, tw_model *model) {
  model->nodes = tw_arena_alloc(model->arena, file->joint_count, sizeof *model->nodes);
  if (!model->nodes) return tw_fail(file->error, TW_NO_MEMORY, "out of memory");
  model->node_count = file->joint_count;
  for (uint32_t i = 0; i < file->joint_count; i++) {
    const bvh_joint *joint = &file->joints[i];
    tw_node *node = &model->nodes[i];
    *node =
        (tw_node){.parent = joint->parent, .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
    memcpy(node->rest.translation, joint->offset, sizeof joint->offset);
    tw_status status = name_node(file, joint, model->arena, &node->name);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

/* Notes what the hierarchy holds and the model does not. */
static void lose_hierarchy(bvh_file *file) {
  for (uint32_t i = 0; i < file->joint_count; i++) {
    const bvh_joint *joint = &file->joints[i];
    bool is_placed = joint->has_offset || joint->counts[BVH_POSITION] == 3 || joint->parent == TW_NO_INDEX;
    tw_lose(&file->losses, "joint has no OFFSET: it is where its parent is",
            "joints have no OFFSET: they are where their parents are", !is_placed, 0);
    tw_lose(&file->losses, "channel of scale is left out", "channels of scale are left out",
            joint->counts[BVH_SCALE], 0);
  }
}

static tw_status read_file(bvh_file *file, size_t size, tw_model *model) {
  next_word(file); /* HIERARCHY */
  tw_status status = read_hierarchy(file);
  if (status == TW_OK) status = make_nodes(file, model);
  if (status == TW_OK) lose_hierarchy(file);
  if (status == TW_OK && file->has_motion) status = read_motion(file, size, model);
  if (status == TW_OK && !file->has_motion) tw_model_warn(model, "there is no MOTION, and so no clip");
  if (status == TW_OK) tw_losses_tell(&file->losses, model);
  return status;
}

bool tw_is_bvh(const uint8_t *bytes, size_t size) {
  bvh_file file = {.at = (const char *)bytes + tw_byte_order_mark(bytes, size),
                   .end = (const char *)bytes + size};
  return word_is(next_word(&file), "hierarchy");
}

tw_status tw_bvh_read(const uint8_t *bytes, size_t size, tw_model **out, tw_error *error) {
  if (!tw_is_bvh(bytes, size)) return tw_fail_line(error, TW_SYNTAX, 1, "a BVH file begins with HIERARCHY");
  tw_model *model = tw_model_create();
  if (!model) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  model->format = TW_FORMAT_BVH;
  const char *start = (const char *)bytes + tw_byte_order_mark(bytes, size);
  bvh_file file = {.at = start, .end = (const char *)bytes + size, .line = 1, .error = error};
  tw_status status = read_file(&file, size, model);
  tw_free(file.joints);
  tw_free(file.channels);
  return tw_model_end(model, status, out, error);
}
