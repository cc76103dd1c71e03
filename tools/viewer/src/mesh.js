// A mesh: tiles as they come and go, their materials, and what is known of them.

import { Box3, Color, Matrix4, Mesh, Sphere, Vector3 } from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'meshoptimizer/decoder';
import { TilesRenderer } from '3d-tiles-renderer/three';
import { decimals } from './format.js';
import { boundary, MODES, surface, wire } from './material.js';
import { distinct, SIGNED_COLUMN } from './ramps.js';
import { source } from './source.js';

/** Linear light as sRGB, both from 0 to 1. */
const encoded = x => x <= 0.0031308 ? 12.92 * x : 1.055 * x ** ( 1 / 2.4 ) - 0.055;

/** Number of values looked at for the range of a column. */
const SAMPLES = 20000;

const wireMaterial = wire();

export class MeshView {

	/**
	 * `part` tells where the mesh is, and how it lies in the coordinates of the page; `front` is its one colour. `changed`
	 * is called when something new is to be drawn, `failed` with a message when something cannot be.
	 */
	constructor( renderer, camera, { part, front, changed, failed, opened } ) {

		const from = source( part.path );
		this.changed = changed;
		this.name = part.name;
		this.matrix = part.matrix ? new Matrix4().fromArray( part.matrix ) : new Matrix4();
		this.inverse = this.matrix.clone().invert();
		/** Values that the tiles of this mesh share. */
		this.own = { uMode: { value: 0 }, uFront: { value: front }, uShift: { value: 0 } };
		this.embedded = from.embedded;
		this.mode = 'plain';
		this.wireframe = false;
		this.edges = false;
		this.missing = new Set();
		this.detail = 1.5;
		this.coarser = 1;
		this.info = {};

		const tiles = this.tiles = new TilesRenderer( from.url );
		tiles.registerPlugin( from.plugin );
		tiles.group.matrixAutoUpdate = false;
		tiles.group.matrix.copy( this.matrix );
		tiles.group.updateMatrixWorld( true );
		const loader = new GLTFLoader( tiles.manager );
		loader.setMeshoptDecoder( MeshoptDecoder );
		tiles.manager.addHandler( /\.(gltf|glb)$/, loader );
		tiles.registerPlugin( { name: 'MATERIALS', processTileModel: ( scene, tile ) => this.#dress( scene, tile ) } );
		tiles.lruCache.maxSize = Infinity;
		tiles.lruCache.minSize = 0;
		tiles.setCamera( camera );
		tiles.setResolutionFromRenderer( camera, renderer );
		tiles.addEventListener( 'needs-update', changed );
		tiles.addEventListener( 'load-model', changed );
		tiles.addEventListener( 'dispose-model', ( { tile } ) => tile.surface = tile.wires = null );
		tiles.addEventListener( 'tile-visibility-change', ( { tile, visible } ) => this.#shown( tile, visible ) );
		tiles.addEventListener( 'load-root-tileset', ( { tileset } ) => { this.#open( tileset ); opened(); } );
		tiles.addEventListener( 'load-error', ( { tile, error, url } ) => this.#missing( tile, error, url, failed ) );
		this.budget = 1024;

	}

	/** Bytes of tiles that the browser may hold, in MiB. */
	set budget( mib ) {

		const cache = this.tiles.lruCache;
		this.mib = mib;
		cache.maxBytesSize = mib * 2 ** 20;
		cache.minBytesSize = 0.7 * mib * 2 ** 20;
		this.changed();

	}

	get budget() { return this.mib; }

	/** Begins with another camera. */
	use( camera, renderer ) {

		for ( const other of [ ...this.tiles.cameras ] ) this.tiles.deleteCamera( other );
		this.tiles.setCamera( camera );
		this.tiles.setResolutionFromRenderer( camera, renderer );

	}

	#open( tileset ) {

		const noted = tileset.extras?.outcrop ?? {};
		this.info = {
			triangles: 0, columns: [], crs: null, epsg: null, source: 'mesh',
			...noted,
			origin: noted.origin ?? [ 0, 0, 0 ],
			step: noted.step?.[ 0 ] ?? 0,
		};
		// Rounded coordinates have as many decimals as are right.
		this.decimals = this.info.step > 0 ? this.info.exact === false ? Math.max( 0, Math.floor( - Math.log10( 2 * this.info.step ) ) ) : decimals( this.info.step ) : 3;
		const sphere = new Sphere(), box = new Box3();
		this.tiles.getBoundingSphere( sphere );
		const bounds = tileset.root.boundingVolume.box;
		if ( bounds ) {

			const half = new Vector3( ...[ 0, 1, 2 ].map( k => Math.abs( bounds[ 3 + k ] ) + Math.abs( bounds[ 6 + k ] ) + Math.abs( bounds[ 9 + k ] ) ) );
			box.min.fromArray( bounds ).sub( half );
			box.max.fromArray( bounds ).add( half );

		} else sphere.getBoundingBox( box );
		this.sphere = sphere.applyMatrix4( this.matrix );
		this.box = box.applyMatrix4( this.matrix );

	}

	// Missing tiles.

	#missing( tile, error, url, failed ) {

		if ( ! tile ) {

			failed( null, `The mesh cannot be loaded: ${ error?.message ?? error }` );
			return;

		}

		const name = tile.content?.uri ?? String( url );
		this.missing.add( tile );
		// The coarser tile stays, instead of a hole.
		if ( tile.parent ) tile.parent.geometricError = 0;
		failed( name, tile.parent ? 'the mesh is coarser there' : 'it is the coarsest one, so nothing can be shown' );
		this.changed();

	}

	/** Tries missing tiles again. */
	retry() {

		for ( const tile of this.missing ) if ( tile.parent ) tile.parent.geometricError = tile.parent.measuredError ?? tile.parent.geometricError;
		this.missing.clear();
		this.tiles.resetFailedTiles();
		this.changed();

	}

	// Tiles.

	/** Gives a new tile our materials. */
	#dress( scene, tile ) {

		const matrix = new Matrix4();
		scene.updateMatrixWorld( true );
		for ( let at = tile; at; at = at.parent ) at.measuredError ??= at.geometricError;
		const number = tile.content.uri.match( /(\d+)[^\d]*$/ )?.[ 1 ] ?? 0;
		tile.number = Number( number );
		const found = [];
		scene.traverse( object => ( object.isMesh || object.isLineSegments ) && found.push( object ) );
		for ( const object of found ) {

			object.material.dispose();
			// The scene stands in the frame of the mesh: its matrix has the turn to z-up.
			matrix.copy( object.matrixWorld );
			object.userData.own = matrix.clone();
			object.userData.mesh = this;
			object.userData.tile = tile;
			if ( object.isLineSegments ) {

				object.material = boundary();
				object.visible = this.edges;
				object.raycast = () => {};
				object.renderOrder = 1;

			} else {

				const colors = Boolean( object.geometry.attributes.color );
				object.material = surface( colors, matrix.premultiply( this.matrix ).elements[ 14 ], new Color(), this.own );
				tile.surface = object;
				this.#color( tile );

			}

		}

	}

	/** What is known of a column, if the mesh has it. */
	column( name ) { return this.info.columns.find( c => c.name === name ); }

	/** The attribute of a column in tiles. */
	#attribute( geometry, name ) {

		const column = this.column( name );
		return geometry.attributes[ ( column?.attribute ?? '_' + name ).toLowerCase() ];

	}

	#color( tile ) {

		const { geometry, material } = tile.surface;
		const values = this.mode.startsWith( 'column:' ) && this.#attribute( geometry, this.mode.slice( 7 ) );
		if ( values ) geometry.setAttribute( 'value', values );
		else geometry.deleteAttribute( 'value' );
		const number = this.mode === 'level' ? 3 * ( tile.extras?.outcrop?.level ?? tile.internal.depth ) : tile.number;
		material.uniforms.uTile.value.setRGB( ...distinct( number ) );

	}

	/** A tile appears or disappears. */
	#shown( tile, visible ) {

		this.changed();
		if ( visible && tile.surface ) this.#wires( tile );

	}

	#wires( tile ) {

		if ( this.wireframe && ! tile.wires ) {

			tile.wires = new Mesh( tile.surface.geometry, wireMaterial );
			tile.wires.raycast = () => {};
			tile.wires.renderOrder = 2;
			tile.surface.add( tile.wires );
			tile.wires.updateMatrixWorld();

		}

		if ( tile.wires ) tile.wires.visible = this.wireframe;

	}

	/** All tiles that are in memory. */
	#each( visit ) {

		this.tiles.forEachLoadedModel( ( scene, tile ) => visit( tile, scene ) );

	}

	/** True if the tiles have the colours of the scan. */
	get hasColors() { return Boolean( this.info.colors ?? this.column( 'red' ) ); }

	/**
	 * Colours by plain, color, height, tile, level, or column:NAME, whose values are shown less `offset`. What the mesh
	 * does not have is shown in its one colour.
	 */
	colorBy( mode, offset ) {

		this.mode = mode;
		const name = mode.startsWith( 'column:' ) ? mode.slice( 7 ) : null, column = this.column( name );
		const has = name ? column : mode !== 'color' || this.hasColors;
		this.own.uMode.value = ! has ? 0 : name ? ( name === 'classification' ? MODES.class : name === SIGNED_COLUMN ? MODES.signed : MODES.value ) : MODES[ mode ] ?? 0;
		this.own.uShift.value = ( column?.offset ?? 0 ) - ( name ? offset : 0 );
		this.#each( tile => tile.surface && this.#color( tile ) );
		this.changed();

	}

	/**
	 * Range of a column less `offset`, or of heights, without the outermost hundredths, from the coarsest tile in memory;
	 * null if there is none.
	 */
	measure( mode, offset ) {

		if ( mode !== 'height' && ! mode.startsWith( 'column:' ) ) return null;
		let coarsest = null;
		this.#each( tile => {

			if ( tile.surface && ( ! coarsest || tile.internal.depth < coarsest.internal.depth ) ) coarsest = tile;

		} );
		if ( ! coarsest ) return null;
		const { geometry, userData } = coarsest.surface;
		const height = mode === 'height', attribute = height ? geometry.attributes.position : this.#attribute( geometry, mode.slice( 7 ) );
		if ( ! attribute ) return null;
		const shift = height ? 0 : ( this.column( mode.slice( 7 ) ).offset ?? 0 ) - offset;
		const stride = Math.max( 1, Math.floor( attribute.count / SAMPLES ) );
		const values = [], at = new Vector3(), world = this.matrix.clone().multiply( userData.own );
		for ( let n = 0; n < attribute.count; n += stride ) {

			const value = height ? at.fromBufferAttribute( attribute, n ).applyMatrix4( world ).z : attribute.getX( n ) + shift;
			if ( Number.isFinite( value ) ) values.push( value );

		}

		values.sort( ( a, b ) => a - b );
		const cut = Math.floor( values.length / 100 );
		const low = values[ cut ] ?? 0, high = values[ values.length - 1 - cut ] ?? 1;
		// Nothing has changed in the middle of the ramp.
		const most = Math.max( - low, high );
		return mode === 'column:' + SIGNED_COLUMN ? { low: - most, high: most } : { low, high };

	}

	/** The classes that occur in tiles in memory. */
	classes( name ) {

		const found = new Set();
		this.#each( tile => {

			const attribute = tile.surface && this.#attribute( tile.surface.geometry, name );
			for ( let n = 0; attribute && n < attribute.count; n += 1 + ( attribute.count >> 14 ) ) found.add( attribute.getX( n ) );

		} );
		return [ ...found ].sort( ( a, b ) => a - b );

	}

	set showWires( on ) {

		this.wireframe = on;
		for ( const tile of this.tiles.visibleTiles ) if ( tile.surface ) this.#wires( tile );
		this.#each( tile => tile.wires && ( tile.wires.visible = on ) );
		this.changed();

	}

	set showEdges( on ) {

		this.edges = on;
		this.#each( ( tile, scene ) => scene.traverse( object => object.isLineSegments && ( object.visible = on ) ) );
		this.changed();

	}

	// Each frame.

	/** Chooses the tiles that are drawn, for errors that may be larger by a factor while the view moves. */
	update( camera, renderer, factor ) {

		this.tiles.setResolutionFromRenderer( camera, renderer );
		this.tiles.errorTarget = this.detail * Math.max( this.coarser, factor );
		this.tiles.update();

	}

	/** Makes the next frames coarser (1), or less so (-1). */
	limit( way ) {

		const before = this.coarser;
		if ( way > 0 ) this.coarser = Math.min( this.coarser * 1.25, 64 );
		else if ( way < 0 && this.coarser > 1 ) this.coarser = Math.max( this.coarser / 1.1, 1 );
		if ( this.coarser !== before ) this.changed();

	}

	/** Counts of what is drawn. */
	stats() {

		const { tiles } = this;
		let triangles = 0;
		for ( const tile of tiles.visibleTiles ) triangles += ( tile.surface?.geometry.index?.count ?? 0 ) / 3;
		const { stats } = tiles;
		return {
			triangles,
			tiles: tiles.visibleTiles.size,
			loading: stats.queued + stats.downloading + stats.parsing,
			held: tiles.lruCache.itemSet.size,
			bytes: tiles.lruCache.cachedBytes,
			full: stats.refused > 0,
			coarser: this.coarser,
			missing: this.missing.size,
		};

	}

	// Coordinates.

	/** Coordinates of the page as those of the scan. */
	toScan( local ) { return local.clone().applyMatrix4( this.inverse ).toArray().map( ( x, k ) => x + this.info.origin[ k ] ); }

	/** The scan's coordinates as those of the page. */
	toLocal( scan ) { return new Vector3( ...scan.map( ( x, k ) => x - this.info.origin[ k ] ) ).applyMatrix4( this.matrix ); }

	/**
	 * A vertex of a tile: its exact coordinates, by the whole numbers that the tile has of the lattice, and its
	 * values. The renderer's own positions are rounded.
	 */
	vertex( object, index ) {

		const { geometry, userData: { own: { elements: m }, tile } } = object;
		const { position, _low: low } = geometry.attributes;
		const p = [ position.getX( index ), position.getY( index ), position.getZ( index ) ];
		if ( low ) [ low.getX( index ), low.getY( index ), low.getZ( index ) ].forEach( ( x, k ) => p[ k ] += x );
		const { step, origin } = this.info;
		const own = [ 0, 1, 2 ].map( k => m[ k ] * p[ 0 ] + m[ 4 + k ] * p[ 1 ] + m[ 8 + k ] * p[ 2 ] + m[ 12 + k ] ).map( x => step > 0 ? Math.round( x / step ) * step : x );
		const scan = own.map( ( x, k ) => x + origin[ k ] ), local = new Vector3( ...own ).applyMatrix4( this.matrix );
		const values = this.info.columns.map( ( { name, offset = 0 } ) => {

			const attribute = this.#attribute( geometry, name );
			return attribute ? [ name, attribute.getX( index ) + offset ] : null;

		} ).filter( Boolean );
		const color = geometry.attributes.color;
		if ( color ) values.unshift( [ 'color', [ color.getX( index ), color.getY( index ), color.getZ( index ) ].map( x => Math.round( 255 * encoded( x ) ) ).join( ' ' ) ] );
		return { local, scan, values, level: tile?.extras?.outcrop?.level, text: scan.map( x => x.toFixed( this.decimals ) ) };

	}

}
