/* A ship as a simulator that nobody can look into: the MMG standard model behind the FMI, version 2 or 3 (co-simulation).

The equations are those of src/seatruth/models/mmg.py, written a second time by hand, so that a test can hold both
together. Every variable is an entry of `value`, whose index is its value reference; build.py writes these indices into
variables.h, and the same numbers into modelDescription.xml. Inputs come in units of the bridge: deg, rpm, kN. Compile
with -DFMI_VERSION=2 or 3. The prototypes are those of the standards' own headers, which come with fmpy.

The parameter `trouble` makes it misbehave where the resistance R_0 exceeds `trouble_above`, as foreign simulators do:
1 ends the process, 2 never returns, 3 gives numbers that are none, 4 reports an error, 5 ends it at the first step. */

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#if FMI_VERSION == 2
#include "fmi2Functions.h"
#else
#include "fmi3Functions.h"
#endif
#include "variables.h"

#define PI 3.14159265358979323846
#define TINY 1e-12
#define LARGEST_YAW 2.0
#define SIDEWAYS 5.0
#define LONGEST_STEP 0.25 /* s: a quarter of the shortest time that the ship knows; longer intervals take several */

typedef struct {
    double value[COUNT];
    double t;
} Ship;

static double signed_root(double x) { return x / sqrt(sqrt(x * x + 1e-16)); }

/* Speed of the water into the propeller, and what the propeller pushes the ship with, N: without what it takes from the
hull. From the velocity through the water. */
static double propeller(const double *V, double u, double v, double r, double *u_P, double *over_area) {
    const double U = sqrt(u * u + v * v + TINY), scale = fmax(U, fabs(r) * V[p_L] / LARGEST_YAW);
    const double beta = atan2(-v, sqrt(u * u + TINY)), beta_P = beta - V[p_x_P] * r * V[p_L] / scale;
    const double C_2 = beta_P > 0.0 ? V[p_C_2_plus] : V[p_C_2_minus];
    *u_P = u * (1.0 - V[p_w_P0]) * (1.0 + (1.0 - exp(-V[p_C_1] * fabs(beta_P))) * (C_2 - 1.0));
    const double nD = V[i_n] / 60.0 * V[p_D_P];
    *over_area = V[p_k_0] * nD * fabs(nD) + V[p_k_1] * fabs(nD) * *u_P + V[p_k_2] * *u_P * fabs(*u_P);
    return (1.0 - V[p_t_P]) * V[p_rho] * V[p_D_P] * V[p_D_P] * *over_area;
}

static void through_water(const double *V, const double *s, double *u, double *v) {
    *u = s[3] - V[i_north] * cos(s[2]) - V[i_east] * sin(s[2]);
    *v = s[4] - V[i_east] * cos(s[2]) + V[i_north] * sin(s[2]);
}

/* d/dt of x, y, psi, u, v, r. */
static void rates(const double *V, const double *s, double *d) {
    const double psi = s[2], over_u = s[3], over_v = s[4], r = s[5], rho = V[p_rho], L = V[p_L];
    double u, v;
    through_water(V, s, &u, &v);
    const double u_c = over_u - u, v_c = over_v - v;

    /* hull */
    const double U2 = u * u + v * v + TINY, U = sqrt(U2);
    const double scale = fmax(U, fabs(r) * L / LARGEST_YAW), v1 = v / scale, r1 = r * L / scale;
    const double ahead = fmax(-1.0, fmin(1.0, SIDEWAYS * u / U)), vv = v1 * v1, vr = v1 * r1, rr = r1 * r1;
    const double area = 0.5 * rho * L * V[p_d], q = area * scale * scale;
    double X = q * (V[p_X_vv] * vv + V[p_X_vr] * vr + V[p_X_rr] * rr + V[p_X_vvvv] * vv * vv) - area * U2 * V[p_R_0] * ahead;
    double Y = q * (v1 * (V[p_Y_v] + V[p_Y_vvv] * vv + V[p_Y_vvr] * vr + V[p_Y_vrr] * rr) + r1 * (V[p_Y_r] * ahead + V[p_Y_rrr] * rr));
    double N = q * L * (v1 * (V[p_N_v] * ahead + V[p_N_vvv] * vv + V[p_N_vvr] * vr + V[p_N_vrr] * rr) + r1 * (V[p_N_r] + V[p_N_rrr] * rr));
    const double beta = atan2(-v, sqrt(u * u + TINY));

    /* propeller */
    double u_P, thrust;
    const double push = propeller(V, u, v, r, &u_P, &thrust);

    /* rudder */
    const double slipstream = signed_root(u_P * fabs(u_P) + 8.0 / PI * thrust);
    const double inside = u_P + V[p_kappa] * (slipstream - u_P), eta = V[p_D_P] / V[p_H_R];
    const double u_R = V[p_epsilon] * signed_root(eta * inside * fabs(inside) + (1.0 - eta) * u_P * fabs(u_P));
    const double beta_R = beta - V[p_l_R] * r1, v_R = U * (beta_R > 0.0 ? V[p_gamma_R_plus] : V[p_gamma_R_minus]) * beta_R;
    const double U_R = sqrt(u_R * u_R + v_R * v_R + TINY), delta = V[i_delta] * PI / 180.0;
    const double F_N = 0.5 * rho * V[p_A_R] * V[p_f_alpha] * U_R * (u_R * sin(delta) - v_R * cos(delta)), across = F_N * cos(delta);
    X += push - (1.0 - V[p_t_R]) * F_N * sin(delta);
    Y -= (1.0 + V[p_a_H]) * across;
    N -= (V[p_x_R] + V[p_a_H] * V[p_x_H]) * L * across;

    /* rigid body over ground, added mass through the water; a steady current turns in body axes with the ship */
    const double m = rho * V[p_nabla], added = 0.5 * rho * L * L * V[p_d];
    const double m_x = added * V[p_m_x], m_y = added * V[p_m_y], J_z = added * L * L * V[p_J_z], mx_G = m * V[p_x_G];
    const double I_z = m * (V[p_k_zz] * L) * (V[p_k_zz] * L) + V[p_x_G] * mx_G + J_z;
    X += m * over_v * r + m_y * v * r + mx_G * r * r + m_x * r * v_c + 1000.0 * V[i_X];
    Y += -m * over_u * r - m_x * u * r - m_y * r * u_c + 1000.0 * V[i_Y];
    N += -mx_G * over_u * r + 1000.0 * V[i_N];
    const double determinant = (m + m_y) * I_z - mx_G * mx_G;
    d[0] = over_u * cos(psi) - over_v * sin(psi);
    d[1] = over_u * sin(psi) + over_v * cos(psi);
    d[2] = r;
    d[3] = X / (m + m_x);
    d[4] = (I_z * Y - mx_G * N) / determinant;
    d[5] = ((m + m_y) * N - mx_G * Y) / determinant;
}

/* One classical Runge-Kutta step of h seconds; inputs are held. */
static void advance(Ship *ship, double h) {
    double *s = ship->value + FIRST_OUTPUT, at[6], k[4][6];
    const double part[3] = {0.5 * h, 0.5 * h, h};
    rates(ship->value, s, k[0]);
    for (int stage = 0; stage < 3; stage++) {
        for (int j = 0; j < 6; j++) at[j] = s[j] + part[stage] * k[stage][j];
        rates(ship->value, at, k[stage + 1]);
    }
    for (int j = 0; j < 6; j++) s[j] += h / 6.0 * (k[0][j] + 2.0 * k[1][j] + 2.0 * k[2][j] + k[3][j]);
}

/* Advances to t + h; false where it reports an error. */
static bool step(Ship *ship, double h) {
    const int trouble = (int)ship->value[p_trouble];
    if (trouble && ship->value[p_R_0] > ship->value[p_trouble_above]) {
        if (trouble == 1 && ship->t > 5.0) abort();
        if (trouble == 2) for (volatile int forever = 1; forever;) {}
        if (trouble == 3) ship->value[FIRST_OUTPUT + 3] = NAN;
        if (trouble == 4 && ship->t > 5.0) return false;
        if (trouble == 5) _Exit(3);
    }
    const int parts = (int)ceil(h / LONGEST_STEP - 1e-9);
    for (int k = 0; k < parts; k++) advance(ship, h / parts);
    ship->t += h;
    return true;
}

static void restart(Ship *ship) {
    memcpy(ship->value, STARTS, sizeof STARTS);
    ship->t = 0.0;
}

static Ship *made(void) {
    Ship *ship = calloc(1, sizeof(Ship));
    if (ship) restart(ship);
    return ship;
}

/* Value references, and real and whole numbers, are of the same C types in both versions of the FMI. */
static void set_reals(Ship *ship, const unsigned vr[], size_t n, const double value[]) {
    for (size_t k = 0; k < n; k++) ship->value[vr[k]] = value[k];
}
static void get_reals(const Ship *ship, const unsigned vr[], size_t n, double value[]) {
    const double *V = ship->value, *s = V + FIRST_OUTPUT;
    double u, v, into, over_area;
    through_water(V, s, &u, &v);
    for (size_t k = 0; k < n; k++)
        value[k] = vr[k] == l_thrust ? propeller(V, u, v, s[5], &into, &over_area) / 1000.0 : V[vr[k]];
}
static void set_whole(Ship *ship, const unsigned vr[], size_t n, const int value[]) {
    for (size_t k = 0; k < n; k++) ship->value[vr[k]] = value[k];
}
static void get_whole(const Ship *ship, const unsigned vr[], size_t n, int value[]) {
    for (size_t k = 0; k < n; k++) value[k] = (int)ship->value[vr[k]];
}

#if FMI_VERSION == 2

#define OK_(name, ...) fmi2Status fmi2##name(__VA_ARGS__) { return fmi2OK; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String place,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    return type == fmi2CoSimulation && !strcmp(guid, TOKEN) ? made() : NULL;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    set_reals(c, vr, n, value);
    return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    get_reals(c, vr, n, value);
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
    set_whole(c, vr, n, value);
    return fmi2OK;
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
    get_whole(c, vr, n, value);
    return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no) { return step(c, h) ? fmi2OK : fmi2Error; }
fmi2Status fmi2Reset(fmi2Component c) {
    restart(c);
    return fmi2OK;
}
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
OK_(SetDebugLogging, fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
OK_(SetupExperiment, fmi2Component c, fmi2Boolean d, fmi2Real tolerance, fmi2Real start, fmi2Boolean s, fmi2Real stop)
OK_(EnterInitializationMode, fmi2Component c)
OK_(ExitInitializationMode, fmi2Component c)
OK_(Terminate, fmi2Component c)
OK_(CancelStep, fmi2Component c)
OK_(GetBoolean, fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[])
OK_(SetBoolean, fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[])
OK_(GetString, fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[])
OK_(SetString, fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[])
OK_(GetFMUstate, fmi2Component c, fmi2FMUstate *state)
OK_(SetFMUstate, fmi2Component c, fmi2FMUstate state)
OK_(FreeFMUstate, fmi2Component c, fmi2FMUstate *state)
OK_(SerializedFMUstateSize, fmi2Component c, fmi2FMUstate state, size_t *size)
OK_(SerializeFMUstate, fmi2Component c, fmi2FMUstate state, fmi2Byte data[], size_t size)
OK_(DeSerializeFMUstate, fmi2Component c, const fmi2Byte data[], size_t size, fmi2FMUstate *state)
OK_(GetDirectionalDerivative, fmi2Component c, const fmi2ValueReference a[], size_t n, const fmi2ValueReference b[], size_t m, const fmi2Real dv[], fmi2Real dz[])
OK_(SetRealInputDerivatives, fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], const fmi2Real value[])
OK_(GetRealOutputDerivatives, fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], fmi2Real value[])
OK_(GetStatus, fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
OK_(GetRealStatus, fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
OK_(GetIntegerStatus, fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
OK_(GetBooleanStatus, fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
OK_(GetStringStatus, fmi2Component c, const fmi2StatusKind kind, fmi2String *value)

#else

#define REFERENCES const fmi3ValueReference vr[], size_t n
#define OK_(name, ...) fmi3Status fmi3##name(__VA_ARGS__) { return fmi3OK; }
#define NONE_(type) OK_(Get##type, fmi3Instance c, REFERENCES, fmi3##type v[], size_t m) \
    OK_(Set##type, fmi3Instance c, REFERENCES, const fmi3##type v[], size_t m)

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String place, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference between[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    return strcmp(token, TOKEN) ? NULL : made();
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String place, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) { return NULL; }
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String place, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback clock,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) { return NULL; }
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3SetFloat64(fmi3Instance c, REFERENCES, const fmi3Float64 value[], size_t m) {
    set_reals(c, vr, n, value);
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, REFERENCES, fmi3Float64 value[], size_t m) {
    get_reals(c, vr, n, value);
    return fmi3OK;
}
fmi3Status fmi3SetInt32(fmi3Instance c, REFERENCES, const fmi3Int32 value[], size_t m) {
    set_whole(c, vr, n, value);
    return fmi3OK;
}
fmi3Status fmi3GetInt32(fmi3Instance c, REFERENCES, fmi3Int32 value[], size_t m) {
    get_whole(c, vr, n, value);
    return fmi3OK;
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no, fmi3Boolean *event,
                      fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *last) {
    *event = *end = *early = false;
    *last = t + h;
    return step(c, h) ? fmi3OK : fmi3Error;
}
fmi3Status fmi3Reset(fmi3Instance c) {
    restart(c);
    return fmi3OK;
}
const char *fmi3GetVersion(void) { return fmi3Version; }
NONE_(Float32) NONE_(Int8) NONE_(UInt8) NONE_(Int16) NONE_(UInt16) NONE_(UInt32) NONE_(Int64) NONE_(UInt64)
NONE_(Boolean) NONE_(String)
OK_(GetBinary, fmi3Instance c, REFERENCES, size_t sizes[], fmi3Binary v[], size_t m)
OK_(SetBinary, fmi3Instance c, REFERENCES, const size_t sizes[], const fmi3Binary v[], size_t m)
OK_(GetClock, fmi3Instance c, REFERENCES, fmi3Clock v[])
OK_(SetClock, fmi3Instance c, REFERENCES, const fmi3Clock v[])
OK_(SetDebugLogging, fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[])
OK_(EnterInitializationMode, fmi3Instance c, fmi3Boolean d, fmi3Float64 tolerance, fmi3Float64 t, fmi3Boolean s, fmi3Float64 stop)
OK_(ExitInitializationMode, fmi3Instance c)
OK_(EnterEventMode, fmi3Instance c)
OK_(EnterStepMode, fmi3Instance c)
OK_(EnterConfigurationMode, fmi3Instance c)
OK_(ExitConfigurationMode, fmi3Instance c)
OK_(EnterContinuousTimeMode, fmi3Instance c)
OK_(Terminate, fmi3Instance c)
OK_(GetNumberOfVariableDependencies, fmi3Instance c, fmi3ValueReference vr, size_t *n)
OK_(GetVariableDependencies, fmi3Instance c, fmi3ValueReference vr, size_t a[], fmi3ValueReference b[], size_t d[], fmi3DependencyKind k[], size_t n)
OK_(GetFMUState, fmi3Instance c, fmi3FMUState *state)
OK_(SetFMUState, fmi3Instance c, fmi3FMUState state)
OK_(FreeFMUState, fmi3Instance c, fmi3FMUState *state)
OK_(SerializedFMUStateSize, fmi3Instance c, fmi3FMUState state, size_t *size)
OK_(SerializeFMUState, fmi3Instance c, fmi3FMUState state, fmi3Byte data[], size_t size)
OK_(DeserializeFMUState, fmi3Instance c, const fmi3Byte data[], size_t size, fmi3FMUState *state)
OK_(GetDirectionalDerivative, fmi3Instance c, const fmi3ValueReference a[], size_t n, const fmi3ValueReference b[], size_t m, const fmi3Float64 s[], size_t k, fmi3Float64 v[], size_t l)
OK_(GetAdjointDerivative, fmi3Instance c, const fmi3ValueReference a[], size_t n, const fmi3ValueReference b[], size_t m, const fmi3Float64 s[], size_t k, fmi3Float64 v[], size_t l)
OK_(GetIntervalDecimal, fmi3Instance c, REFERENCES, fmi3Float64 i[], fmi3IntervalQualifier q[])
OK_(GetIntervalFraction, fmi3Instance c, REFERENCES, fmi3UInt64 a[], fmi3UInt64 b[], fmi3IntervalQualifier q[])
OK_(GetShiftDecimal, fmi3Instance c, REFERENCES, fmi3Float64 s[])
OK_(GetShiftFraction, fmi3Instance c, REFERENCES, fmi3UInt64 a[], fmi3UInt64 b[])
OK_(SetIntervalDecimal, fmi3Instance c, REFERENCES, const fmi3Float64 i[])
OK_(SetIntervalFraction, fmi3Instance c, REFERENCES, const fmi3UInt64 a[], const fmi3UInt64 b[])
OK_(SetShiftDecimal, fmi3Instance c, REFERENCES, const fmi3Float64 s[])
OK_(SetShiftFraction, fmi3Instance c, REFERENCES, const fmi3UInt64 a[], const fmi3UInt64 b[])
OK_(EvaluateDiscreteStates, fmi3Instance c)
OK_(UpdateDiscreteStates, fmi3Instance c, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *d, fmi3Boolean *e, fmi3Boolean *f, fmi3Float64 *t)
OK_(CompletedIntegratorStep, fmi3Instance c, fmi3Boolean no, fmi3Boolean *a, fmi3Boolean *b)
OK_(SetTime, fmi3Instance c, fmi3Float64 t)
OK_(SetContinuousStates, fmi3Instance c, const fmi3Float64 x[], size_t n)
OK_(GetContinuousStateDerivatives, fmi3Instance c, fmi3Float64 x[], size_t n)
OK_(GetEventIndicators, fmi3Instance c, fmi3Float64 x[], size_t n)
OK_(GetContinuousStates, fmi3Instance c, fmi3Float64 x[], size_t n)
OK_(GetNominalsOfContinuousStates, fmi3Instance c, fmi3Float64 x[], size_t n)
OK_(GetNumberOfEventIndicators, fmi3Instance c, size_t *n)
OK_(GetNumberOfContinuousStates, fmi3Instance c, size_t *n)
OK_(GetOutputDerivatives, fmi3Instance c, REFERENCES, const fmi3Int32 order[], fmi3Float64 v[], size_t m)
OK_(ActivateModelPartition, fmi3Instance c, fmi3ValueReference clock, fmi3Float64 t)

#endif
