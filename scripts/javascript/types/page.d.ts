// What is not checked: elements found in a page and their events, as templates promise them, and other makers' modules.
interface ParentNode {
  querySelector(selector: string): any;
  querySelectorAll(selector: string): NodeListOf<any>;
}
interface NonElementParentNode {
  getElementById(id: string): any;
}
interface Document {
  getElementById(id: string): any;
}
interface Element {
  closest(selector: string): any;
  setAttribute(name: string, value: any): void;
}
interface EventTarget {
  value?: any;
  tagName?: string;
}
interface Event {
  detail?: any;
}
declare module "racecraft.pages/codemirror.js" {
  export const bracketMatching: any, defaultKeymap: any, drawSelection: any, EditorState: any, EditorView: any;
  export const highlightActiveLine: any, highlightActiveLineGutter: any, HighlightStyle: any;
  export const highlightSelectionMatches: any, history: any, historyKeymap: any, indentOnInput: any, indentUnit: any;
  export const indentWithTab: any, keymap: any, lineNumbers: any, lintGutter: any, lintKeymap: any, python: any;
  export const search: any, searchKeymap: any, setDiagnostics: any, syntaxHighlighting: any, tags: any;
  export const toggleTabFocusMode: any;
}
declare module "racecraft.pages/uplot.js" {
  const uPlot: any;
  export default uPlot;
}
