/* SPDX-License-Identifier: MIT */
/*
 * The interpolator and the coefficient records of a program, for any program of three segments and pieces and of two to
 * six path axes that passed the checks, any kernel, wherever the cursor is, and any times: no segment, piece or record
 * is requested that there is not, nothing overflows. Analysed by Eva in `make proofs` (tools/analysis/prove.py explains
 * the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-slevel 60
 * instead: core/interpolator.c: } else { => } else if (arc_length_q40_mm < segment->from_q40_mm) {
 * assumes: program_segment_get program_segment_start program_piece_get program_piece_duration program_piece_override program_piece_start ph_segment_expand ph_segment_end
 * shows: interpolator_at_q42 interpolator_at_piece interpolator_at_arc_length interpolator_acceleration_q40 interpolator_search_begin interpolator_search_step interpolator_seek interpolator_ends coefficients_make
 * mutant: core/coefficients.c: i + 1u < p->header.piece_count ? (int32_t)piece_size => i < p->header.piece_count ? (int32_t)piece_size
 * mutant: core/interpolator.c: if (next < p->header.piece_count && => if (next <= p->header.piece_count &&
 * mutant: core/coefficients.c: i + 1u == p->header.segment_count ? INT64_MAX => i == p->header.segment_count ? INT64_MAX
 * mutant: core/coefficients.c: i == 0 ? INT64_MIN => i == 1 ? INT64_MIN
 * mutant: core/override_ramp.c: first + least(count, left) => first + count
 */
#include "core/ph_segment.h"
#include "core/program.h"
#include "proof.h"
#include "ramp_contracts.h"
#include "segment_bounds.h"

/*@ predicate extra_in_range(struct program_segment *g, integer k) =
      -POINT_MOST < g->extra[k].start_q40 < POINT_MOST && -(1 << 47) <= g->extra[k].b_q40[4] < (1 << 47); */

/*@ requires i < p->header.segment_count;
    assigns *out \from i;
    ensures \initialized(out) && 0 <= out->start_q40_mm < (1 << 62);
    ensures point_in_range(out) && is_bounded(out) && out->axis_count == p->header.axis_count;
    ensures extra_in_range(out, 0) && extra_in_range(out, 1) && extra_in_range(out, 2); */
void program_segment_get(const struct program *p, uint32_t i, struct program_segment *out);

/*@ requires i < p->header.segment_count;
    assigns \result \from i;
    ensures 0 <= \result < (1 << 62); */
int64_t program_segment_start(const struct program *p, uint32_t i);

/*@ requires i < p->header.piece_count;
    assigns *out \from i;
    ensures \initialized(out) && 0 < out->duration_q32_s <= (1 << 54) && 0 <= out->start_q40_mm < (1 << 62); */
void program_piece_get(const struct program *p, uint32_t i, struct program_piece *out);

/*@ requires i < p->header.piece_count;
    assigns \result \from i;
    ensures 0 <= \result < (1 << 62); */
int64_t program_piece_start(const struct program *p, uint32_t i);

/*@ requires i < p->header.piece_count;
    assigns \result \from i;
    ensures 0 < \result <= (1 << 54); */
uint64_t program_piece_duration(const struct program *p, uint32_t i);

/*@ requires \initialized(segment) && is_bounded(segment);
    assigns *ph \from *segment;
    ensures \initialized(ph) && ph->axis_count == segment->axis_count; */
void ph_segment_expand(struct ph_segment *ph, const struct program_segment *segment);

/* A segment is 32 mm long at most. */
/*@ requires \initialized(ph);
    assigns end_q48_mm[0 .. 3] \from *ph;
    ensures \initialized(end_q48_mm + (0 .. 3));
    ensures -(1 << 60) < end_q48_mm[1] < (1 << 60) && -(1 << 60) < end_q48_mm[2] < (1 << 60);
    ensures -(1 << 60) < end_q48_mm[3] < (1 << 60); */
void ph_segment_end(const struct ph_segment *ph, int64_t end_q48_mm[PH_AXES]);

#include "core/interpolator.c"
#include "core/kernel.c"
#include "core/coefficients.c"
#include "core/override_ramp.c"

#define COUNT 3u

static void piece_set(void *piece, const struct program_piece *from)
{
    struct feed_piece *f = piece;
    f->start_q40_mm = from->start_q40_mm;
}

static void segment_set(void *segment, const struct ph_segment *from)
{
    struct kernel_fixed_segment *k = segment;
    k->arc.exponent = from->exponent;
}

static void space_set(void *segment, const struct ph_segment *from)
{
    struct kernel_fixed_space *k = segment;
    k->arc.exponent = from->exponent;
    k->extras = program_extra_axes(from->axis_count);
    for (uint32_t i = 0; i < k->extras; i++) {
        k->extra[i].scale = 1;
    }
}

static void piece_at(const void *piece, struct feed_point *out, uint64_t t_q42_s)
{
    const struct feed_piece *f = piece;
    (void)t_q42_s;
    prove(f->start_q40_mm >= 0);
    out->arc_length_q40_mm = any_between(INT64_MIN, INT64_MAX);
    out->feed_q32_mm_s = any_between(-POWER(62), POWER(62));
}

static int64_t piece_acceleration(const void *piece, uint64_t t_q42_s)
{
    const struct feed_piece *f = piece;
    (void)t_q42_s;
    prove(f->start_q40_mm >= 0);
    return any_between(INT64_MIN, INT64_MAX);
}

static void segment_at(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm)
{
    const struct kernel_fixed_segment *k = segment;
    position_q40[0] = k->arc.exponent;
    position_q40[1] = arc_length_q40_mm;
}

static void space_at(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm)
{
    const struct kernel_fixed_space *k = segment;
    segment_at(segment, position_q40, arc_length_q40_mm);
    position_q40[2] = arc_length_q40_mm;
    for (uint32_t i = 0; i < k->extras; i++) {
        position_q40[PROGRAM_SPACE + i] = k->extra[i].scale;
    }
}

static const struct kernel any_kernel = {
    .piece_size = sizeof(struct feed_piece),
    .piece_set = piece_set,
    .piece_at = piece_at,
    .piece_acceleration = piece_acceleration,
    .plane = {.segment_size = sizeof(struct kernel_fixed_segment),
              .segment_set = segment_set,
              .segment_at = segment_at},
    .space = {.segment_size = offsetof(struct kernel_fixed_space, extra),
              .extra_size = sizeof(struct extra_axis),
              .segment_set = space_set,
              .segment_at = space_at},
};

const struct kernel *const kernels_linked[KERNELS] = {&any_kernel, NULL, NULL};

static uint64_t
    records[COUNT * (sizeof(struct coefficients_piece) + sizeof(struct coefficients_segment)) / 8 +
                        1];
static uint32_t filled;

static int take(void *context, const uint8_t *bytes, uint32_t size)
{
    memcpy((uint8_t *)context + filled, bytes, size);
    filled += size;
    return 0;
}

static uint64_t any_time(void)
{
    return (uint64_t)any_between(INT64_MIN, INT64_MAX);
}

/* Wherever the cursor is: after begin, and after any call before. Pieces are looked for without regard to the segment, and
 * segments to the piece. */
static void place(struct interpolator *it, uint32_t i)
{
    it->piece = coefficients_piece_at(it->program, it->kernel, i);
    it->segment = coefficients_segment_at(it->program, it->kernel, i);
}

/* Records of segments follow those of pieces in memory: neither is taken for the other. */
static void stays(const struct interpolator *it)
{
    prove((const void *)it->piece <
          (const void *)coefficients_segment_at(it->program, it->kernel, 0));
    prove(it->segment >= coefficients_segment_at(it->program, it->kernel, 0));
}

/* By arc length; and the time of one: a step from a piece, and one between any two times. */
static void along_path(struct interpolator *it, uint32_t i)
{
    struct interpolator_point point;
    struct interpolator_search search;
    place(it, i);
    interpolator_at_arc_length(it, any_between(INT64_MIN, INT64_MAX), &point);
    stays(it);
    place(it, i);
    interpolator_acceleration_q40(it, it->piece, any_time());
    interpolator_search_begin(&search, i, any_between(INT64_MIN, INT64_MAX));
    interpolator_search_step(it, &search);
    prove(search.piece_index < COUNT);
    stays(it);
    place(it, i);
    interpolator_search_begin(&search, i, any_between(INT64_MIN, INT64_MAX));
    search.piece = it->piece;
    search.bisecting = 1;
    search.low_q42_s = any_time();
    search.high_q42_s = any_time();
    interpolator_search_step(it, &search);
}

static void interpolate(const struct program *p)
{
    struct interpolator it;
    struct interpolator_point point;
    struct interpolator_point last;
    interpolator_ends(p, p->coefficients_for, &point, &last);
    if (interpolator_begin(&it, p) != 0) {
        return;
    }
    for (uint32_t i = 0; i < COUNT; i++) {
        place(&it, i);
        interpolator_at_q42(&it, any_time(), &point);
        stays(&it);
        place(&it, i);
        interpolator_at_piece(&it, it.piece, any_time(), &point);
        stays(&it);
        place(&it, i);
        interpolator_seek(&it, any_time());
        stays(&it);
        along_path(&it, i);
    }
    place(&it, 0);
    interpolator_at(&it, any_time(), &point);
}

/* With so many path axes. */
static void program_of(uint32_t axis_count)
{
    static uint8_t image[1];
    struct program p;
    Frama_C_make_unknown((char *)&p.header, sizeof p.header);
    p.image = image;
    p.header.axis_count = (uint16_t)axis_count;
    p.header.segment_count = COUNT;
    p.header.piece_count = COUNT;
    p.header.period_us = (uint32_t)1000 << any_between(0, 3);
    p.header.duration_q32_s = (uint64_t)any_between(1, POWER(54) - 1);
    p.header.length_q40_mm = any_between(1, POWER(62) - 1);
    filled = 0;
    if (coefficients_make(&p, &any_kernel, take, records) == 0) {
        prove(filled == coefficients_size(&p, &any_kernel) && filled <= sizeof records);
        coefficients_attach(&p, &any_kernel, (const uint8_t *)records);
        prove(coefficients_segment_at(&p, &any_kernel, 0)->from_q40_mm == INT64_MIN);
        prove(coefficients_segment_at(&p, &any_kernel, COUNT - 1u)->to_q40_mm == INT64_MAX);
        interpolate(&p);
        reached();
    }
}

int main(void)
{
    program_of(PROGRAM_PLANE);
    program_of(PROGRAM_SPACE);
    program_of(PROGRAM_AXES);
    return 0;
}
