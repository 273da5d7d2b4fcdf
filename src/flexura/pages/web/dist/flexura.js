var e={},d=typeof document>"u"?void 0:document.body?.dataset.page;d!==void 0&&e[d]?.();
