/* SPDX-License-Identifier: MIT */
/* declarations: the part of the C side that Python uses (cffi API mode: the C compiler checks it against the real
 * headers and fills in each "..."). Read by build_native.py only. Declarations only. Meanings, units and contexts: the
 * headers named here. */

/* core/program.h, core/program_rules.h, core/program_check.h */
struct program_header {
    uint32_t image_size;
    uint32_t period_us;
    uint32_t segment_count;
    uint32_t piece_count;
    uint16_t flags;
    uint16_t axis_count;
    uint64_t duration_q32_s;
    int64_t length_q40_mm;
    uint32_t event_count;
    ...;
};
struct program {
    struct program_header header;
    ...;
};
struct program_limits {
    uint32_t axis_count, period_us, feed_um_s, acceleration_um_s2, jerk_mm_s3;
    int64_t min_q40_mm[6], max_q40_mm[6];
    uint32_t axis_velocity_um_s[6], axis_acceleration_um_s2[6], axis_jerk_mm_s3[6];
    uint32_t stop_time_ms, chunk;
    ...;
};
struct program_fault {
    int code;
    uint32_t index;
};
int program_open(struct program *p, const uint8_t *image, uint32_t size);
uint32_t program_ticks(const struct program *p);
int program_check(const struct program *p, const struct program_limits *limits,
                  struct program_fault *fault);
const char *program_error_text(int code);

/* core/stop_check.h */
enum program_stop_kind { PROGRAM_STOP_HOLD, PROGRAM_STOP_FAULT };
struct stop_bound {
    uint32_t time_us, distance_um;
};
struct stop_walk {
    ...;
};
void stop_walk_begin(struct stop_walk *walk, const struct program *p, enum program_stop_kind kind);
struct stop_bound stop_walk_back(struct stop_walk *walk, uint32_t piece);

/* core/brake_check.h */
struct program_stop {
    uint8_t jerk_down, deceleration, jerk_up;
    ...;
};
struct brake_check {
    uint32_t evaluations;
    ...;
};
void brake_check_begin(struct brake_check *check, const struct program *p,
                       const struct program_limits *limits);
int brake_check_piece(struct brake_check *check, uint32_t piece, enum program_stop_kind kind,
                      const struct program_stop *stop);

/* core/coefficients.h */
struct kernel;
const struct kernel *kernel_find(uint32_t number);
uint64_t coefficients_size(const struct program *p, const struct kernel *kernel);
int coefficients_make_in(struct program *p, const struct kernel *kernel, void *memory,
                         uint64_t size);

/* core/interpolator.h */
struct interpolator_point {
    int64_t arc_length_q40_mm, feed_q32_mm_s, position_q40[6];
};
struct interpolator {
    ...;
};
int interpolator_begin(struct interpolator *it, const struct program *p);

/* core/path_outputs.h */
struct path_outputs_values {
    uint16_t digital;
    int16_t analogue[3];
};
struct path_outputs {
    struct path_outputs_values values;
    ...;
};
void path_outputs_begin(struct path_outputs *outputs, const struct program *program,
                        int64_t arc_length_q40_mm);
void path_outputs_step(struct path_outputs *outputs, int64_t arc_length_q40_mm,
                       int64_t feed_q32_mm_s);

/* core/feed_override.h */
struct override_state {
    int64_t override_q57, slope_q56;
};
struct override_plan {
    struct override_state now;
    ...;
};
struct feed_override {
    struct override_plan plan;
    uint32_t phase;
    ...;
};
void feed_override_begin(struct feed_override *f, const struct program *p, uint32_t period_us,
                         uint64_t time_q42_s);
void feed_override_hold(struct feed_override *f);
void feed_override_resume(struct feed_override *f);
void feed_override_set(struct feed_override *f, uint32_t percent);
void feed_override_stop(struct feed_override *f);
void feed_override_fault_stop(struct feed_override *f);
int feed_override_next(struct feed_override *f, struct interpolator *it,
                       struct interpolator_point *out);
int feed_override_state(const struct feed_override *f);
int feed_override_late(const struct feed_override *f);
uint64_t feed_override_time_q42(const struct feed_override *f);
int64_t feed_override_feed_q32(const struct feed_override *f);
uint32_t feed_override_actual_q30(const struct feed_override *f);
int feed_override_waits(const struct feed_override *f);
uint32_t feed_override_bound_us(const struct feed_override *f, int kind);

/* plant/drive.h */
struct drive_plant {
    double gain_rad_s_v, time_constant_s, screw_mm_rad, torque_to_volts, volts_limit;
};
struct drive_pdff {
    double k_pp_rad_s_mm, k_pv_nm_s_rad, k_iv_per_s, k_pf_rad_mm, k_vf;
};
struct drive_config {
    struct drive_plant plant;
    struct drive_pdff pdff;
    uint32_t encoder_counts_per_rev, loop_rate_hz, counts_per_mm, period_us, interpolation, speed,
        delay_samples, integral;
};
struct drive {
    ...;
};
int drive_init(struct drive *drive, const struct drive_config *config);
const char *drive_error_text(int code);
void drive_place(struct drive *drive, int32_t target_counts);
void drive_period(struct drive *drive, int32_t target_counts);
int32_t drive_position_counts(const struct drive *drive);
int16_t drive_volts_mv(const struct drive *drive);
bool drive_parked(const struct drive *drive);

/* offline/contour.h */
struct contour_segment {
    ...;
};
struct contour {
    uint32_t axes;
    ...;
};
void contour_begin(struct contour *contour, const struct program *program,
                   struct contour_segment *segments);
double contour_distance_mm(struct contour *contour, double arc_length_mm, const double point_mm[3]);
void contour_errors_um(struct contour *contour, uint32_t n, const int64_t *arc_length_q40_mm,
                       const int32_t *act_counts, uint32_t stride, const uint32_t *counts_per_unit,
                       double *errors_um);
void contour_extra_errors(struct contour *contour, const struct program *program, uint32_t n,
                          const int64_t *arc_length_q40_mm, const int32_t *act_counts,
                          const uint32_t *counts_per_unit, double *errors);

/* offline/offline_fault.h */
enum offline_fault_kind {
    OFFLINE_FAULT_ENCODER_FREEZE,
    OFFLINE_FAULT_ENCODER_JUMP,
    OFFLINE_FAULT_SATURATE,
    OFFLINE_FAULT_LOAD,
    OFFLINE_FAULT_SETPOINT_LOST,
    ...
};
struct offline_fault {
    enum offline_fault_kind kind;
    uint32_t axis, at, ticks;
    double value;
};

/* offline/offline.h */
struct offline_row {
    int64_t arc_length_q40_mm;
    int64_t feed_q32_mm_s;
    int64_t cmd_q40_mm[6];
    double contour_error_um;
    int32_t set_counts[6];
    int32_t act_counts[6];
    int16_t volts_mv[6];
    uint32_t tick;
    struct path_outputs_values outputs;
    ...;
};
struct offline {
    ...;
};
int offline_begin(struct offline *sim, const struct program *program,
                  const struct drive_config *drives, struct contour_segment *segments);
struct feedforward_gains {
    uint32_t period_us, counts_per_mm, velocity_permille;
    int32_t torque_per_acceleration_q16, torque_per_velocity_q16;
};
void offline_feedforward(struct offline *sim, const struct feedforward_gains *gains);
void offline_equip(struct offline *sim, int axis, double rated_torque_nm, double friction_volts);
int offline_faults(struct offline *sim, const struct offline_fault *faults, uint32_t count);
enum offline_order_kind {
    OFFLINE_ORDER_HOLD,
    OFFLINE_ORDER_RESUME,
    OFFLINE_ORDER_OVERRIDE,
    OFFLINE_ORDER_STOP,
    OFFLINE_ORDER_FAULT_STOP,
    ...
};
struct offline_order {
    enum offline_order_kind kind;
    uint32_t tick, percent;
};
struct offline_stop {
    uint32_t tick, rest_tick, bound_us;
    int64_t from_q40_mm, rest_q40_mm;
};
int offline_orders(struct offline *sim, const struct offline_order *orders, uint32_t count);
void offline_stop_get(const struct offline *sim, struct offline_stop *stop);
int offline_run(struct offline *sim, struct offline_row *rows, uint32_t n);
int offline_points(struct interpolator *interp, uint32_t n, const uint64_t *time_q42_s,
                   uint32_t counts_per_mm, struct interpolator_point *points, int32_t *counts);
void offline_times(const struct program *program, uint32_t tick0, uint32_t n, uint64_t *time_q42_s);
void offline_counts(uint32_t n, const int64_t *q40_mm, uint32_t counts_per_mm, int32_t *counts);
enum offline_error {
    OFFLINE_ERR_COEFFICIENTS,
    OFFLINE_ERR_PERIOD,
    OFFLINE_ERR_COUNTS,
    OFFLINE_ERR_FAULT,
    OFFLINE_ERR_DRIVE,
    OFFLINE_ERR_INTERP,
    ...
};

/* offline/stop_search.h */
struct stop_row {
    double s_mm;
    ...;
};
struct stop_bend {
    double by_mm[3][6];
};
struct stop_stretch {
    ...;
};
struct stop_path {
    struct stop_row *rows;
    struct stop_bend *bends;
    struct stop_stretch *groups;
};
struct stop_feed_zone {
    double from_mm, to_mm, feed_mm_s;
};
struct stop_limits {
    double feed, acceleration, jerk, centripetal;
    double axis_velocity[6], axis_acceleration[6], axis_jerk[6], reach[6], time_constant[6];
    const struct stop_feed_zone *zones;
    uint32_t zone_count, reach_at_rate_1, rise_is_cut;
    uint32_t quick;
};
struct stop_found {
    uint8_t known;
    uint8_t kept;
    uint8_t before[3];
    uint8_t start[3];
    uint8_t codes[3];
    double worst_s, mean_s;
};
#define STOP_ROWS ...
uint32_t stop_groups(uint32_t segment_count);
void stop_rows(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path);
void stop_used(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path, struct stop_limits *used);
void stop_search(const struct program *p, const struct stop_limits *limits,
                 const struct stop_path *path, struct stop_found *found);

/* offline/stop_trial.h */
struct stop_use {
    double velocity, acceleration, jerk, path_acceleration, path_jerk;
};
struct stop_case {
    uint64_t seed;
    uint32_t tick;
};
struct stop_trial {
    uint64_t seed;
    uint32_t trials;
    struct stop_limits hold, fault;
    struct stop_use of_hold, of_fault;
    double of_bound[2], longest_s[2];
    uint32_t measured[2], late, failures;
    struct stop_case most, longest, failed;
};
int stop_trial_run(const struct program *p, struct stop_trial *trial);
int stop_trial_again(const struct program *p, struct stop_trial *trial, uint32_t tick);

/* offline/smoothing.h */
struct smoothing {
    uint32_t count, directions;
    const double *point, *normal, *bound, *coefficient;
};
size_t smoothing_work(uint32_t count, uint32_t ways);
void smoothing_solve(const struct smoothing *s, double barrier, double *shift, double *work);

/* numerics/quadratic_program.h */
struct quadratic_program {
    uint32_t intervals, rows;
    double penalty, curvature, tolerance;
    const double *gradient, *hessian, *low, *high, *coefficient;
    const int64_t *interval;
    const double *least, *most;
};
struct quadratic_report {
    uint32_t iterations;
    double violated, gradient, gap;
};
size_t quadratic_work(uint32_t intervals, uint32_t rows);
int quadratic_solve(const struct quadratic_program *program, double *unknown, double *work,
                    struct quadratic_report *report);

/* numerics/ph_chain.h */
struct ph_chain {
    uint32_t segments, planar, extra;
    const double *start, *arc, *speed, *preimage, *extra_axes;
};
void ph_locate(const struct ph_chain *chain, uint32_t count, const double *arc_mm, double tolerance,
               int64_t *segment, double *xi);
void ph_frames(const struct ph_chain *chain, uint32_t count, const int64_t *segment,
               const double *xi, double *r1, double *r2, double *r3, double *curvature);

/* numerics/override_headroom.h */
struct override_samples {
    uint32_t axes, cells, samples, by_sample;
    const int64_t *piece;
    const double *velocity, *acceleration, *jerk, *most_acceleration, *most_jerk;
    const double *signed_velocity, *signed_acceleration, *reach, *time_constant;
};
struct override_powers {
    const double *first, *second, *third;
};
void override_rates(const struct override_samples *samples, const struct override_powers *at,
                    double *rest, double *jerk);
void override_seconds(const struct override_samples *samples, const struct override_powers *at,
                      const double *rate, double *second);

/* offline/axis_run.h */
struct axis_run {
    double rated_torque_nm, friction_volts;
    int32_t start_counts;
    uint32_t count;
    const int32_t *target_counts, *speed_counts_s;
    const int16_t *torque_permille;
};
int axis_run(const struct drive_config *config, const struct axis_run *run, double *position_mm,
             double *volts);

/* offline/stream.h */
struct chunk {
    uint32_t job, sequence;
    struct program program;
    ...;
};
struct offline_part {
    struct chunk chunk;
    ...;
};
struct offline_stream {
    struct feed_override feed;
    struct offline_part *active;
    uint32_t moving, resting, underruns;
    ...;
};
void offline_stream_begin(struct offline_stream *s, const struct kernel *kernel,
                          const struct program_limits *limits, uint8_t *memory, uint32_t size);
int offline_stream_check(const struct offline_stream *s, struct offline_part *part,
                         const uint8_t *bytes, uint32_t size, struct program_fault *fault);
int offline_stream_add(struct offline_stream *s, struct offline_part *part);
int64_t offline_stream_run(struct offline_stream *s, uint32_t count, uint32_t until_rest,
                           struct interpolator_point *points, struct path_outputs_values *values);
