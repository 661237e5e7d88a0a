// What numpy is slow at: short vectors at many instants, and sums of products in bands of blocks.
//
// Every function has the arguments of one in numpy, which says what it does and is held against
// it: `second_derivatives` for the tree, `chain_rule` for control points. Arrays are of doubles, C
// order, and hold K instants; what is added to, or written in part, is zero before.

#include <algorithm>
#include <cstddef>

using std::size_t;

namespace {

constexpr int DOF = 55, POINTS = 4, CHAIN = 13, LOWER = 20, ROOT = 6;

// ---- spatial vectors: linear part first -------------------------------------------------------

inline void cross(const double *x, const double *y, double *out, double scale = 1.0) {
    out[0] += scale * (x[1] * y[2] - x[2] * y[1]);  // out += scale x x y
    out[1] += scale * (x[2] * y[0] - x[0] * y[2]);
    out[2] += scale * (x[0] * y[1] - x[1] * y[0]);
}

inline void cross_motion(const double *m, const double *n, double *out) {  // out += m x n
    cross(m + 3, n, out);
    cross(m, n + 3, out);
    cross(m + 3, n + 3, out + 3);
}

inline void cross_force(const double *m, const double *f, double *out) {  // out += m x* f
    cross(m + 3, f, out);
    cross(m, f, out + 3);
    cross(m + 3, f + 3, out + 3);
}

inline double power(const double *m, const double *n, const double *f) {  // m . (n x* f)
    double g[6] = {};
    cross_force(n, f, g);
    return m[0] * g[0] + m[1] * g[1] + m[2] * g[2] + m[3] * g[3] + m[4] * g[4] + m[5] * g[5];
}

inline void turned(const double *M, const double *w, double sign, double *out) {
    const double trace = M[0] + M[4] + M[8];  // out += sign (tr M - M) w
    for (int i = 0; i < 3; ++i, M += 3)
        out[i] += sign * (trace * w[i] - M[0] * w[0] - M[1] * w[1] - M[2] * w[2]);
}

// Sums over bodies, `Carried` in numpy: h, M, p, L, dM, f
constexpr int H = 0, M2 = 3, P = 12, L = 15, DM = 18, F = 27, CARRIED = 33;

inline void inertia(double m, const double *of, const double *x, double scale, double *out) {
    double y[6] = {m * x[0], m * x[1], m * x[2], 0, 0, 0};  // out += scale I x
    cross(x + 3, of + H, y);
    turned(of + M2, x + 3, 1.0, y + 3);
    cross(of + H, x, y + 3);
    for (int i = 0; i < 6; ++i) out[i] += scale * y[i];
}

inline void gyration(const double *of, const double *x, double *out) {  // out += D x
    cross(x + 3, of + P, out, 2.0);
    turned(of + DM, x + 3, 1.0, out + 3);
    cross(x + 3, of + L, out + 3);
}

inline void gyration_T(const double *of, const double *u, double *out) {  // angular part of D^T u
    cross(of + P, u, out, 2.0);
    turned(of + DM, u + 3, 1.0, out);
    cross(of + L, u + 3, out);
}

// angular part of d(D^T u)/dv x; `of` holds P = I u, then Q, then the rate of M along u
inline void bent(const double *of, const double *x, double *out) {
    cross(x, of, out, 2.0);
    cross(x + 3, of + 3, out);
    turned(of + 9, x + 3, -1.0, out);
}

// the rate of M of a body with moments `of` that moves along x
inline void moment_rate(const double *of, const double *x, double *out) {
    double half[9];
    for (int i = 0; i < 3; ++i) {
        double turn[3] = {0, 0, 0};
        cross(x + 3, of + M2 + 3 * i, turn);  // w x column i of M
        for (int j = 0; j < 3; ++j) half[3 * j + i] = x[j] * of[H + i] + turn[j];
    }
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) out[3 * i + j] = half[3 * i + j] + half[3 * j + i];
}

// moments and forces of a body in its pose, J being its pseudo-inertia
void body(const double *pose, const double *J, const double *v, const double *a, double *of) {
    double W[16] = {};  // J in the world's axes
    for (int i = 0; i < 16; ++i)
        for (int x = 0; x < 16; ++x)
            W[i] += pose[i / 4 * 4 + x / 4] * J[x] * pose[i % 4 * 4 + x % 4];
    for (int i = 0; i < 3; ++i) {
        of[H + i] = W[4 * i + 3];
        for (int j = 0; j < 3; ++j) of[M2 + 3 * i + j] = W[4 * i + j];
    }
    inertia(J[15], of, v, 1.0, of + P);  // momentum p, L
    inertia(J[15], of, a, 1.0, of + F);
    cross_force(v, of + P, of + F);
    moment_rate(of, v, of + DM);
}

// what each joint carries is summed up from the bodies and the joints below it
void sum_up(const int *parent, double *carried, int n) {
    for (int j = DOF - 1; j > 0; --j)
        if (parent[j] >= 0)
            for (int i = 0; i < n; ++i) carried[parent[j] * n + i] += carried[j * n + i];
}

// ---- what the ground gives: values with first and second derivatives in 7 variables -----------

constexpr int VARIABLES = 7;  // the wrench, and how far forces lean

struct Jet {
    double v = 0.0, g[VARIABLES] = {}, h[VARIABLES][VARIABLES] = {};

    Jet(double value = 0.0) : v(value) {}

    Jet &add(double x, const Jet &o) {  // this += x o
        v += x * o.v;
        for (int i = 0; i < VARIABLES; ++i) g[i] += x * o.g[i];
        for (int i = 0; i < VARIABLES; ++i)
            for (int j = 0; j < VARIABLES; ++j) h[i][j] += x * o.h[i][j];
        return *this;
    }

    Jet mapped(double f, double slope, double bend) const {
        Jet out(f);
        for (int i = 0; i < VARIABLES; ++i) out.g[i] = slope * g[i];
        for (int i = 0; i < VARIABLES; ++i)
            for (int j = 0; j < VARIABLES; ++j) out.h[i][j] = slope * h[i][j] + bend * g[i] * g[j];
        return out;
    }
};

inline Jet operator+(Jet a, const Jet &b) { return a.add(1.0, b); }
inline Jet operator-(Jet a, const Jet &b) { return a.add(-1.0, b); }
inline Jet operator*(double x, const Jet &a) { return Jet().add(x, a); }
inline Jet operator+(Jet a, double x) { a.v += x; return a; }

inline Jet operator*(const Jet &a, const Jet &b) {
    Jet out(a.v * b.v);
    for (int i = 0; i < VARIABLES; ++i) out.g[i] = a.v * b.g[i] + b.v * a.g[i];
    for (int i = 0; i < VARIABLES; ++i)
        for (int j = 0; j < VARIABLES; ++j)
            out.h[i][j] = a.v * b.h[i][j] + b.v * a.h[i][j] + a.g[i] * b.g[j] + b.g[i] * a.g[j];
    return out;
}

inline Jet inverse(const Jet &a) {
    return a.mapped(1.0 / a.v, -1.0 / (a.v * a.v), 2.0 / (a.v * a.v * a.v));
}

// max(s, 0), rounded within r of 0: `_ramp` in numpy
inline Jet ramp(const Jet &s, double r) {
    const double u = std::clamp((s.v + r) / (2 * r), 0.0, 1.0), u2 = u * u;
    return s.mapped(2 * r * (u * u2 - u2 * u2 / 2) + std::max(s.v - r, 0.0), 3 * u2 - 2 * u * u2,
                    3 * u * (1 - u) / r);
}

// a smooth step from 0 to 1: `_step` in numpy
inline Jet step(const Jet &x) {
    const double u = std::clamp(x.v, 0.0, 1.0), w = 1 - u;
    return x.mapped(u * u * u * (10 - 15 * u + 6 * u * u), 30 * u * u * w * w,
                    60 * u * w * (1 - 2 * u));
}

// The quantities of an instant in the order of `ground_reaction.QUANTITIES`
void ground_at(const double *y, bool both, const double *A, const double *B, const double *balls,
               const double *numbers, Jet *out) {
    const double spread = numbers[0], rounding = numbers[1], blend = numbers[2], end = numbers[3];
    Jet F[6];
    for (int i = 0; i < 6; ++i) F[i].v = y[i], F[i].g[i] = 1.0;
    const Jet *R = F, *M = F + 3, per = inverse(R[1]);
    Jet *zmp = out, *pressure = out + 4, *wrench = out + 8, *toes = out + 20, *links = out + 22;
    zmp[0] = M[2] * per, zmp[1] = -1.0 * (M[0] * per);  // (M_z / R_y, -M_x / R_y)
    const Jet yaw = M[1] - (zmp[1] * R[0] - zmp[0] * R[2]);
    const double AB[2] = {B[0] - A[0], B[1] - A[1]}, square = AB[0] * AB[0] + AB[1] * AB[1];
    Jet l2(1.0);
    if (both) {
        const Jet s = (AB[0] / square) * (zmp[0] + -A[0]) + (AB[1] / square) * (zmp[1] + -A[1]);
        l2 = ramp(s, rounding) - ramp(s + -1.0, rounding);
    }
    out[2] = yaw, out[3] = l2;
    const Jet l1 = -1.0 * l2 + 1.0, push = spread * (l2 * l1 * R[1]);
    for (int f = 0; f < 2; ++f) {
        const double *at = f ? B : A, sign = f ? -1.0 : 1.0;
        const Jet &share = f ? l2 : l1;
        Jet *p = pressure + 2 * f, *W = wrench + 6 * f;
        for (int i = 0; i < 2; ++i) p[i] = both ? zmp[i] - AB[i] * l2 + (at[i] - A[i]) : zmp[i];
        W[0] = R[0] * share + (sign * AB[0]) * push;
        W[1] = R[1] * share;
        W[2] = R[2] * share + (sign * AB[1]) * push;
        W[3] = -1.0 * (p[1] * W[1]);
        W[4] = p[1] * W[0] - p[0] * W[2] + yaw * share;
        W[5] = p[0] * W[1];
        toes[f] = step((1.0 / (end - blend)) * (p[1] + (-balls[f] - blend)));
        for (int i = 0; i < 6; ++i) {
            links[12 * f + 6 + i] = W[i] * toes[f];
            links[12 * f + i] = W[i] - links[12 * f + 6 + i];
        }
    }
}

// ---- products of rows -------------------------------------------------------------------------

// BLAS as scipy has it (scipy.linalg.cython_blas), set by `use_blas`
typedef void (*Dgemm)(const char *, const char *, const int *, const int *, const int *,
                      const double *, const double *, const int *, const double *, const int *,
                      const double *, double *, const int *);
Dgemm dgemm = nullptr;

// blocks[first + i, d] += the part of T by the points i and j = gap + d ahead; transposed if d < 0
void fold(const double *T, int l, const int *rows, int r, const int *columns, const double *mask,
          int first, int gap, int reach, double *blocks) {
    for (int i = 0; i < POINTS; ++i)
        for (int j = 0; j < POINTS; ++j) {
            const int d = gap + j - i, at = d < 0 ? first + i + d : first + i;
            double *B = blocks + (size_t(at) * (reach + 1) + (d < 0 ? -d : d)) * DOF * DOF;
            const int down = d < 0 ? 1 : DOF, along = d < 0 ? DOF : 1;
            for (int x = 0; x < l; ++x) {
                const double *t = T + size_t(i * l + x) * POINTS * r + j * r;
                double *row = B + rows[x] * down;
                for (int y = 0; y < r; ++y)
                    row[columns[y] * along] += mask ? mask[x * r + y] * t[y] : t[y];
            }
        }
}

}  // namespace

extern "C" {

const char *kernel_source() { return KERNEL_SOURCE; }  // digest of this file

int kernel_runs_here() {
#ifdef __AVX2__
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return 0;
#endif
    return 1;
}

// ground_reaction._quantities. both: (K,); A, B: (K, 2); value (K, 46) and its derivatives
void ground(int K, int n, const double *variables, const double *both, const double *A,
            const double *B, const double *balls, const double *numbers, double *value,
            double *partials, double *second) {
    Jet found[46];
    for (int k = 0; k < K; ++k, A += 2, B += 2) {
        ground_at(variables + k * n, both[k] > 0.0, A, B, balls, numbers, found);
        for (const Jet &jet : found) {
            *value++ = jet.v;
            partials = std::copy(jet.g, jet.g + n, partials);
            for (int i = 0; i < n; ++i) second = std::copy(jet.h[i], jet.h[i] + n, second);
        }
    }
}

// ground_reaction.load_partials. S: (K, 55, 6); W: (K, 2, 2, 6), W_y: (..., n); chains: (4, 13)
void load_partials(int K, int n, const int *length, const int *chains, const double *S,
                   const double *W, const double *W_y, double *by_posture, double *by_ground) {
    for (int k = 0; k < K; ++k)
        for (int l = 0; l < 4; ++l) {
            const double *s = S + size_t(k) * DOF * 6, *w = W + (k * 4 + l) * 6;
            const double *w_y = W_y + (w - W) * n;
            const int *chain = chains + CHAIN * l;
            for (int i = ROOT; i < length[l]; ++i) {
                const double *own = s + 6 * chain[i];
                double *ground = by_ground + (size_t(k) * LOWER + chain[i]) * n;
                for (int x = 0; x < 6; ++x)
                    for (int y = 0; y < n; ++y) ground[y] -= own[x] * w_y[x * n + y];
                double *posture = by_posture + (size_t(k) * LOWER + chain[i]) * LOWER;
                for (int j = 0; j < i; ++j)  // - (S_j x S_i)^T W = S_i^T (S_j x* W)
                    posture[chain[j]] += power(own, s + 6 * chain[j], w);
            }
        }
}

// ground_reaction.add_torques_to_adjoint. weights: (K, 55); ground (K, n), ground_second (K, n, n)
void load_second(int K, int n, const int *length, const int *chains, const double *S,
                 const double *W, const double *W_y, const double *W_yy, const double *weights,
                 double *ground, double *ground_second, double *second, double *mixed) {
    for (int k = 0; k < K; ++k)
        for (int l = 0; l < 4; ++l) {
            const size_t at = size_t(k) * 4 + l;
            const double *s = S + size_t(k) * DOF * 6, *w = W + at * 6;
            const int *chain = chains + CHAIN * l;
            double p[6] = {}, moved[CHAIN][6] = {};
            for (int j = length[l] - 1; j >= 0; --j) {
                cross_motion(s + 6 * chain[j], p, moved[j]);
                for (int x = 0; x < 6; ++x)
                    p[x] += weights[k * DOF + chain[j]] * s[6 * chain[j] + x];
            }
            for (int x = 0; x < 6; ++x) {
                for (int y = 0; y < n; ++y) ground[k * n + y] -= p[x] * W_y[(at * 6 + x) * n + y];
                for (int y = 0; y < n * n; ++y)
                    ground_second[size_t(k) * n * n + y] -= p[x] * W_yy[(at * 6 + x) * n * n + y];
            }
            for (int j = 0; j < length[l]; ++j) {
                double *column = mixed + size_t(k) * n * LOWER + chain[j];
                for (int x = 0; x < 6; ++x)
                    for (int y = 0; y < n; ++y)
                        column[y * LOWER] -= W_y[(at * 6 + x) * n + y] * moved[j][x];
                for (int i = 0; i <= j; ++i) {  // W^T (S_i x d_j), i above j
                    const double sum = power(moved[j], s + 6 * chain[i], w);
                    second[(size_t(k) * LOWER + chain[i]) * LOWER + chain[j]] += sum;
                    if (i < j) second[(size_t(k) * LOWER + chain[j]) * LOWER + chain[i]] += sum;
                }
            }
        }
}

// Feet._motion. chains: (2, 13); place: (K, 2, 4, 3); velocity likewise, J, J_rate (..., 13)
void feet_motion(int K, const int *chains, const int *on_toes, const double *S, const double *v,
                 const double *place, double *velocity, double *J, double *J_rate) {
    for (int k = 0; k < K; ++k)
        for (int f = 0; f < 2; ++f)
            for (int p = 0; p < 4; ++p) {
                const size_t at = (size_t(k) * 2 + f) * 4 + p;
                const double *x = place + at * 3, *s = S + size_t(k) * DOF * 6;
                const int *chain = chains + f * CHAIN, n = CHAIN - !on_toes[f * 4 + p];
                double turned[CHAIN][3] = {}, moved[CHAIN][3] = {}, below[3] = {}, sum[3] = {};
                for (int j = 0; j < n; ++j) {
                    const double *axis = s + 6 * chain[j], speed = v[k * DOF + chain[j]];
                    for (int i = 0; i < 3; ++i) {
                        moved[j][i] = axis[i];
                        turned[j][i] = sum[i] += axis[3 + i] * speed;
                    }
                    cross(axis + 3, x, moved[j]);
                }
                for (int j = CHAIN - 1; j >= 0; --j) {
                    double rate[3] = {};
                    cross(turned[j], moved[j], rate);
                    if (j < n) cross(s + 6 * chain[j] + 3, below, rate);
                    for (int i = 0; i < 3; ++i) {
                        J[(at * 3 + i) * CHAIN + j] = moved[j][i];
                        J_rate[(at * 3 + i) * CHAIN + j] = rate[i];
                        below[i] += moved[j][i] * v[k * DOF + chain[j]];
                    }
                }
                for (int i = 0; i < 3; ++i) velocity[at * 3 + i] = below[i];
            }
}

// Feet.add_hessian. by: four (K, 2, 4, 3) weights; qq, qv, vv: (K, 20, 20)
void feet_second(int K, const int *chains, const double *S, const double *v, const double *J,
                 const double *J_rate, const double *by_position, const double *by_velocity,
                 const double *position_second, const double *velocity_second, double *qq,
                 double *qv, double *vv) {
    for (int k = 0; k < K; ++k)
        for (int f = 0; f < 2; ++f) {
            const int *chain = chains + f * CHAIN;
            const double *s = S + size_t(k) * DOF * 6;
            double w_rate[CHAIN][3] = {}, sum[3] = {};
            double QQ[CHAIN][CHAIN] = {}, QV[CHAIN][CHAIN] = {}, VV[CHAIN][CHAIN] = {};
            for (int i = 0; i < CHAIN; ++i) {
                for (int x = 0; x < 3; ++x)
                    sum[x] += s[6 * chain[i] + 3 + x] * v[k * DOF + chain[i]];
                cross(sum, s + 6 * chain[i] + 3, w_rate[i]);
            }
            for (int j = 0; j < CHAIN; ++j) {
                double at[3] = {}, moving[3] = {};
                for (int p = 0; p < 4; ++p) {
                    const size_t o = ((size_t(k) * 2 + f) * 4 + p) * 3;
                    double column[3], rate[3];
                    for (int x = 0; x < 3; ++x)
                        column[x] = J[(o + x) * CHAIN + j], rate[x] = J_rate[(o + x) * CHAIN + j];
                    cross(column, by_position + o, at);
                    cross(rate, by_velocity + o, at);
                    cross(column, by_velocity + o, moving);
                    for (int x = 0; x < 3; ++x) {
                        const double place = position_second[o + x], speed = velocity_second[o + x];
                        for (int i = 0; i < CHAIN; ++i) {
                            const size_t at = (o + x) * CHAIN + i;
                            const double a = J[at], b = J_rate[at];
                            QQ[i][j] += a * place * column[x] + b * speed * rate[x];
                            QV[i][j] += b * speed * column[x];
                            VV[i][j] += a * speed * column[x];
                        }
                    }
                }
                for (int i = 0; i <= j; ++i) {  // i above j
                    const double *w = s + 6 * chain[i] + 3;
                    double posture = 0.0, mixed = 0.0;
                    for (int x = 0; x < 3; ++x) {
                        posture += w[x] * at[x] + w_rate[i][x] * moving[x];
                        mixed += w[x] * moving[x];
                    }
                    QQ[i][j] += posture, QV[i][j] += mixed;
                    if (i < j) QQ[j][i] += posture, QV[j][i] += mixed;
                }
            }
            for (int i = 0; i < CHAIN; ++i)
                for (int j = 0; j < CHAIN; ++j) {
                    const size_t o = (size_t(k) * LOWER + chain[i]) * LOWER + chain[j];
                    qq[o] += QQ[i][j], qv[o] += QV[i][j], vv[o] += VV[i][j];
                }
        }
}

void use_blas(void *pointer) { dgemm = reinterpret_cast<Dgemm>(pointer); }

// Tree.first. S, v_links, b, by_a, f_q, f_v, f_a: (K, 55, 6); bodies, carried: (K, ..., 33)
void tree_first(int K, int n, const int *parent, const int *body_of, const double *J,
                const double *mass, const double *gravity, const double *S, const double *qd,
                const double *qdd, const double *poses, double *v_links, double *b, double *by_a,
                double *f_q, double *f_v, double *f_a, double *bodies, double *carried) {
    double rates[DOF * 6];
    for (int k = 0; k < K; ++k) {
        const double *s = S + k * DOF * 6;
        double *v = v_links + k * DOF * 6, *of = carried + size_t(k) * DOF * CARRIED;
        for (int j = 0; j < DOF; ++j) {
            const int p = parent[j], o = 6 * j;
            double *a = &rates[o], *bj = b + k * DOF * 6 + o, *aj = by_a + k * DOF * 6 + o;
            for (int i = 0; i < 6; ++i)
                v[o + i] = (p >= 0 ? v[6 * p + i] : 0.0) + s[o + i] * qd[k * DOF + j];
            cross_motion(v + o, s + o, bj);
            for (int i = 0; i < 6; ++i) {
                const double above = p >= 0 ? rates[6 * p + i] : (i < 3 ? -gravity[i] : 0.0);
                a[i] = above + s[o + i] * qdd[k * DOF + j] + bj[i] * qd[k * DOF + j];
            }
            cross_motion(a, s + o, aj);
            cross_motion(v + o, bj, aj);
        }
        for (int x = 0; x < n; ++x) {
            const int link = body_of[x];
            double *at = bodies + (size_t(k) * n + x) * CARRIED;
            body(poses + (size_t(k) * n + x) * 16, J + 16 * x, v + 6 * link, &rates[6 * link], at);
            for (int i = 0; i < CARRIED; ++i) of[link * CARRIED + i] += at[i];
        }
        sum_up(parent, of, CARRIED);
        for (int j = 0; j < DOF; ++j) {
            const size_t o = (size_t(k) * DOF + j) * 6;
            const double *c = of + j * CARRIED, m = mass[j];
            cross_force(S + o, c + F, f_q + o);
            inertia(m, c, by_a + o, 1.0, f_q + o);
            gyration(c, b + o, f_q + o);
            inertia(m, c, b + o, 2.0, f_v + o);
            gyration(c, S + o, f_v + o);
            inertia(m, c, S + o, 1.0, f_a + o);
        }
    }
}

// Tree.second. by_u, P_q: (K, 55, 6); Q_q, Q_v: (K, 55, 3)
void tree_second(int K, int n, const int *parent, const int *body_of, const double *J,
                 const double *mass, const double *S, const double *b, const double *bodies,
                 const double *carried, const double *by_torque, const double *by_wrench,
                 double *by_u, double *P_q, double *Q_q, double *Q_v) {
    constexpr int SUM = 18;  // P, Q, the rate of M along u
    for (int k = 0; k < K; ++k) {
        double u[DOF * 6], sums[DOF * SUM] = {};
        for (int j = 0; j < DOF; ++j) {
            const size_t o = (size_t(k) * DOF + j) * 6;
            const double *above = parent[j] >= 0 ? &u[6 * parent[j]] : by_wrench + 6 * k;
            for (int i = 0; i < 6; ++i)
                u[6 * j + i] = above[i] + S[o + i] * by_torque[k * DOF + j];
            cross_motion(&u[6 * j], S + o, by_u + o);
        }
        for (int x = 0; x < n; ++x) {
            const int link = body_of[x];
            const double *at = bodies + (size_t(k) * n + x) * CARRIED, *of_u = &u[6 * link];
            double of[SUM] = {};
            inertia(J[16 * x + 15], at, of_u, 1.0, of);
            gyration_T(at, of_u, of + 6);
            moment_rate(at, of_u, of + 9);
            for (int i = 0; i < SUM; ++i) sums[link * SUM + i] += of[i];
        }
        sum_up(parent, sums, SUM);
        for (int j = 0; j < DOF; ++j) {
            const size_t o = (size_t(k) * DOF + j) * 6;
            const double *of = &sums[j * SUM];
            const double *c = carried + (size_t(k) * DOF + j) * CARRIED;
            double *q = Q_q + o / 2, *v = Q_v + o / 2;
            cross_force(S + o, of, P_q + o);
            inertia(mass[j], c, by_u + o, 1.0, P_q + o);
            cross(S + o + 3, of + 6, q);
            gyration_T(c, by_u + o, q);
            bent(of, b + o, q);
            bent(of, S + o, v);
        }
    }
}

// TreeHessian.on_points. X, Y: (K, 15, 4, n); N: (3, K, 4)
void tree_on_points(int K, int n, const int *dofs, const double *N, const double *S,
                    const double *b, const double *by_a, const double *f_q, const double *f_v,
                    const double *f_a, const double *by_u, const double *P_q, const double *Q_q,
                    const double *Q_v, double *X, double *Y) {
    for (int k = 0; k < K; ++k)
        for (int i = 0; i < 15; ++i)
            for (int p = 0; p < POINTS; ++p, X += n, Y += n) {
                const double q = N[k * 4 + p], v = N[(K + k) * 4 + p], a = N[(2 * K + k) * 4 + p];
                const auto sum = [&](double *to, int width, int x, const double *of_q,
                                     const double *of_v, double v, const double *of_a, double a) {
                    for (int j = 0; j < n; ++j) {
                        const size_t o = (size_t(k) * DOF + dofs[j]) * width + x;
                        to[j] = q * of_q[o] + v * of_v[o] + a * of_a[o];
                    }
                };
                const int x = i < 12 ? i % 6 : i - 9;  // of a spatial vector
                if (i < 6) sum(X, 6, x, by_u, b, 0, S, 0), sum(Y, 6, x, f_q, f_v, v, f_a, a);
                else if (i < 12) sum(X, 6, x, by_a, b, 2 * v, S, a), sum(Y, 6, x, P_q, b, 0, S, 0);
                else sum(X, 6, x, b, S, v, S, 0), sum(Y, 3, x - 3, Q_q, Q_v, v, Q_v, 0);
            }
}

// Half._add_products. left, right: (K, rows, 4, l), (K, rows, 4, r); first, gap: (K,)
void add_products(int K, int rows, int l, const int *left_dofs, int r, const int *right_dofs,
                  const double *mask, const int *first, const int *gap, const double *left,
                  const double *right, int reach, double *blocks, double *T) {
    const double one = 1.0, none = 0.0;  // T has room for a product
    for (int k = 0, end = 0; k < K; k = end) {
        for (end = k + 1; end < K && first[end] == first[k] && gap[end] == gap[k];) ++end;
        const size_t at = size_t(k) * rows * POINTS;
        const int n = (end - k) * rows, l4 = POINTS * l, r4 = POINTS * r;
        // T = L^T R; in the order of columns that BLAS has, R L^T
        dgemm("N", "T", &r4, &l4, &n, &one, right + at * r, &r4, left + at * l, &l4, &none,
              T, &r4);
        fold(T, l, left_dofs, r, right_dofs, mask, first[k], gap[k], reach, blocks);
    }
}

// Grid.onto_points, MusclePartials.on_points. rows: (K, all, 3, width), of which r from `begin` on
// and some columns are taken; less the slopes of each by its own joint, if any; out: (K, r, 4, n)
void onto_points(int K, int all, int begin, int r, int width, int n, const int *columns,
                 const double *N, const double *rows, const double *by_angle,
                 const double *by_velocity, double *out) {
    for (int k = 0; k < K; ++k)
        for (int i = begin; i < begin + r; ++i) {
            const double *of = rows + (size_t(k) * all + i) * 3 * width;
            for (int p = 0; p < POINTS; ++p, out += n) {
                const double q = N[k * 4 + p], v = N[(K + k) * 4 + p], a = N[(2 * K + k) * 4 + p];
                for (int j = 0; j < n; ++j) {
                    const int x = columns[j];
                    out[j] = q * of[x] + v * of[width + x] + a * of[2 * width + x];
                    if (by_angle && x == i) out[j] -= q * by_angle[i] + v * by_velocity[i];
                }
            }
        }
}

// Grid.weighted. P, R: (K, r, 4, n), T: (r, 4, n); w, c, u: (K, r); speed: (K, 4)
void weighted(int K, int r, int n, int own, const double *P, const double *T, const double *within,
              const double *w, const double *c, const double *u, const double *speed, double *R) {
    const int width = POINTS * n;
    for (int k = 0; k < K; ++k)
        for (int i = 0; i < r; ++i) {
            const size_t at = size_t(k) * r + i;
            const double *now = P + at * width, *next = k + 1 < K ? now + r * width : T + i * width;
            const double half = w[at] / 2.0, on = within[k] * u[at];
            double *row = R + at * width;
            for (int j = 0; j < width; ++j) row[j] = half * now[j] + on * next[j];
            for (int p = 0; p < POINTS; ++p) row[p * n + own + i] += c[at] * speed[k * 4 + p];
        }
}

// Half.add_block. qq, qv, vv: (K, n, n) each, or none
void add_block(int K, int n, const int *dofs, const double *N, const int *first, const double *qq,
               const double *qv, const double *vv, int reach, double *blocks) {
    for (int k = 0; k < K; ++k)
        for (int i = 0; i < POINTS; ++i)
            for (int j = i; j < POINTS; ++j) {
                const double qi = N[k * 4 + i], qj = N[k * 4 + j];
                const double vi = N[(K + k) * 4 + i], vj = N[(K + k) * 4 + j];
                const double half = i == j ? 0.5 : 1.0;  // the other half is the transpose
                double *B = blocks + (size_t(first[k] + i) * (reach + 1) + (j - i)) * DOF * DOF;
                for (int x = 0; x < n; ++x) {
                    double *row = B + dofs[x] * DOF;
                    const size_t at = (size_t(k) * n + x) * n, column = size_t(k) * n * n + x;
                    for (int y = 0; qq && y < n; ++y) row[dofs[y]] += half * qi * qj * qq[at + y];
                    for (int y = 0; vv && y < n; ++y) row[dofs[y]] += half * vi * vj * vv[at + y];
                    for (int y = 0; qv && y < n; ++y) row[dofs[y]] += qi * vj * qv[at + y];
                    for (int y = 0; qv && i < j && y < n; ++y)
                        row[dofs[y]] += qj * vi * qv[column + size_t(y) * n];
                }
            }
}

// CyclicBand.dense. blocks: (m, width, b, b); H: (m * b, m * b), zero before
void dense(int m, int width, int b, const double *blocks, double *H) {
    const int n = m * b;
    for (int i = 0; i < m; ++i)
        for (int d = 0; d < width; ++d, blocks += b * b)
            for (int x = 0; x < b; ++x) {
                double *row = H + size_t(i * b + x) * n + (i + d) % m * b;
                double *column = H + size_t((i + d) % m * b) * n + i * b + x;
                for (int y = 0; y < b; ++y)
                    row[y] += blocks[x * b + y], column[size_t(y) * n] += blocks[x * b + y];
            }
}

}  // extern "C"
