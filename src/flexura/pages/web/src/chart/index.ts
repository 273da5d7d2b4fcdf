export { mountChart } from "./chart";
export type { Axis, Chart, ChartData, Curve, Mark, Panel, Values } from "./data";
